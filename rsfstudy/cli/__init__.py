"""Command line ``rsfstudy``.

The package defines options and commands, converts options to arguments of the functions of
``rsfstudy``, prints the results, exports results files to other formats, and returns exit statuses.
The package never computes results. No other package imports ``rsfstudy.cli``.
"""

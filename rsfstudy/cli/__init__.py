"""Command line ``rsfstudy``: options, commands and printed output.

The package converts options to arguments of the functions of ``rsfstudy``, prints the results, and
returns exit statuses. It never computes results, and no other package imports it.
"""

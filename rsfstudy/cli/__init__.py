"""Command line ``rsfstudy``.

The package defines options and commands, converts options to arguments of the functions of
``rsfstudy``, prints the results, and returns exit statuses. It never computes results, and no other
package imports it.
"""

"""Command line ``rsfstudy``.

Each command converts its options to arguments, calls functions of ``rsfstudy``, prints the results
and returns an exit status. The package also exports results files to other formats. The package
never computes results. No other package imports ``rsfstudy.cli``.
"""

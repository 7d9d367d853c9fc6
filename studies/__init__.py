"""Named studies of the package.

Each module without a leading underscore declares one study, a ``Study`` object called ``study``.
"""

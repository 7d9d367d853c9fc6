"""The named studies, one declaration a file; each holds a `Study` named `study`."""

"""What users call from Python: studies, one scene, one motion, and the accessor of datasets."""

from rsfstudy.api import accessor as accessor  # datasets have it from now on

"""Functions that users call: for studies, scenes and motions; and the accessor of datasets."""

from rsfstudy.api import accessor as accessor  # datasets have it from now on

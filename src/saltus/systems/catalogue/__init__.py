"""The models that saltus has, their SI data and their drawings."""

"""Tables: functions from results of named scenes to a DataFrame, registered in `catalogue.TABLES`.

They share the names of their arguments: ``scenes`` are scenes by name; ``paper``, ``reference``, ``claims`` and
``targets`` are the files of `knitstudy.run.catalogue.reference_files`; all others are results, Datasets in the format
of docs/reference/files.md, or several of them by scene. Columns name their unit in brackets.
"""

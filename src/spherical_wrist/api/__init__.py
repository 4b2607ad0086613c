"""Python as people use it: the functions of ``import spherical_wrist as sw``, and the views of their results.

:func:`~spherical_wrist.api.simulate.simulate`, ``compare``, ``frontier``, ``margins`` and ``sweep`` are called alike::

    sw.simulate("pd", disturbance=0.25, duration=4)
    sw.compare(["pd", MyLaw(), "my_law.py:Spring"], cases="default", hardware="realistic")

A law is given by name, as ``path/to/file.py:Name``, as an instance, a class, or a table of name and parameters; several
as a list, or as a table by label. Keywords that are parameters of an experiment change it; ``experiment`` is the one
that they change. Each result has a short ``repr``, a picture in a notebook, and the methods of
:class:`spherical_wrist.result.Result`.
"""

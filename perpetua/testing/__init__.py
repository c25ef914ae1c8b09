"""What every room source, body, motion source and exporter must keep, as tests that a plug-in's package can run.

::

    PERPETUA_TEST_PACKAGE=perpetua-hall pytest --pyargs perpetua.testing

tests all that the installed package ``perpetua-hall`` adds; without the variable, all that comes with Perpetua. A
package whose plug-ins need files, settings or time names a module with samples (``perpetua.testing.samples``) in its
entry point ``samples`` of the group ``perpetua.testing``. Nothing else in Perpetua imports this package; it needs
pytest.
"""

"""The commands, by what they are for. Each parses, calls the pipeline and reports; none decides."""

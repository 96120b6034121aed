"""Interface definitions: fields, CDR serialization, type hashes (REP-2016), code generation, registry."""

"""Message definitions: fields, CDR, hashes (REP-2016), code generation, registry."""

"""The verbs, one module each, and what they share: functions from nouns to nouns; no file, no printing."""

"""Sections 2 to 5 and the appendix: what is computed to judge the statements that no figure bears on."""

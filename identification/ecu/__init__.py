"""A designed slip controller for an engine control unit that anyone can buy: rusEFI.

Read on in this order: export (what is written), exported_law (what of the design goes), lua_script
and lua_laws (the script), traction_table (the static part), lua_machine and replay (the script run
on a recording).
"""

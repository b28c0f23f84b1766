"""Other programs' formats: decks of Abaqus and CalculiX, VTU of ParaView. No physics of its own."""

"""Electronic data sheets of drives (CiA 306): reading, judging, and proposing a bus file."""

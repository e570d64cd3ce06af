"""Studies: which physical effect recordings show and the model lacks, and the gap before and after it is added."""

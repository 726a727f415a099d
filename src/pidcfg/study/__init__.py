"""Where files, conversion and the engine meet: scenarios, drafts, batches of samples, and two sides in one battery."""

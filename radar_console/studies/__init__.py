"""Published experiments, one file each; `catalogue` says what a study is."""

"""Routes over sites whose map does not say all: the learner beside simpler ways, other people, a second route, recordings.

`cases` makes a trial, `ways` are what is compared, `maxent` one of them, `work` runs and measures, `tables` says which trials
the page consists of, `page` writes it.
"""

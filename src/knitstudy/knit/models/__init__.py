"""The models, one folder each: keys, specimens, cost, look in figures (`__init__`), and the problem (`build`)."""

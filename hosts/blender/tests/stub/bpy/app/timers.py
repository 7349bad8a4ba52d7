"""Functions that are called later; `run` calls them."""
_waiting = {}


def register(function, first_interval=0.0, persistent=False):
    _waiting[function] = first_interval


def unregister(function):
    del _waiting[function]


def is_registered(function):
    return function in _waiting


def run():
    """Calls all functions once, and returns the shortest time until the next call."""
    for function in list(_waiting):
        interval = function()
        if interval is None:
            _waiting.pop(function, None)
        else:
            _waiting[function] = interval
    return min(_waiting.values(), default=None)

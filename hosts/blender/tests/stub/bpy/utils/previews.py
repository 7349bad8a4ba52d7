"""Small pictures."""


class _Previews(dict):
    pass


def new():
    return _Previews()


def remove(previews):
    previews.clear()

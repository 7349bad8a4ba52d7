"""Lists of functions."""
depsgraph_update_post, load_pre, load_post, undo_post, redo_post, save_pre, frame_change_post = ([] for _ in range(7))


def persistent(function):
    """A handler that stays when a file is loaded."""
    return function

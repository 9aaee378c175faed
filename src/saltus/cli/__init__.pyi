from .drawn_progress import progress_bar

__all__ = ["main", "progress_bar"]

def main() -> None: ...

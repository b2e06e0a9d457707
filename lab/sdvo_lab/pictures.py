"""matplotlib without a screen."""
import sys

try:
    import matplotlib
except ImportError:
    sys.exit("error: drawing needs matplotlib (python3-matplotlib)")

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402  the backend has to be chosen first


def save(figure, path, dpi=110):
    figure.tight_layout()
    figure.savefig(path, dpi=dpi)
    plt.close(figure)
    print(f"wrote {path}")

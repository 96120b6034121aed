"""One file describes a differential-drive robot; chefbot gives its owner the rest."""

__version__ = "0.1.0"

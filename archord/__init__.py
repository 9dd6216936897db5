"""archord: conformal contact of pins in holes, elastic and plastic, on FEniCSx."""

__version__ = "0.1.0"

"""Pages: the offline 3D replay, its data, and the live preview that serves it."""

"""Drawing without a GPU: the posed robot, a rasterizer, and the pictures made with them."""

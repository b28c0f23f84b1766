"""The knit as beams in contact with friction (Fig. 12b): every yarn a chain of beams along its centreline."""

"""Dialects of keyword files, one file each, which registers itself. What a dialect cannot say is refused by name."""

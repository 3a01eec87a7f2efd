"""Drawings of the chapters that nothing in them moves: one module a chapter."""

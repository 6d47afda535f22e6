"""Tests of the engine, laid out as the engine is."""

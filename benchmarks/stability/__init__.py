"""Extreme scenes: where does it break?"""

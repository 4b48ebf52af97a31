"""Runs SLAM systems on one log and ranks what they give back."""

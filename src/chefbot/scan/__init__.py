"""Conversion of depth images to laser scans and obstacle scans."""

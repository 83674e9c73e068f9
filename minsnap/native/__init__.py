"""The compiled core: C++17 behind ``extern "C"``, loaded with ctypes by ``library.py`` alone.

Problems that it cannot solve or cannot prove are solved by the Python core, which stays the reference.
"""

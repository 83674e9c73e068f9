"""The compiled core and its one door: C++17 behind ``extern "C"``, loaded with ctypes.

Whatever it does not do, or does not prove, is handed over to the Python core, which stays the reference.
"""

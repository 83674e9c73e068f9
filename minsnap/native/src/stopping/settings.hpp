// What is tried for a stop, and how exactly it is judged.
#pragma once

namespace minsnap {

struct StopSettings {
    static constexpr int legs = 2;  // within which it ends
    static constexpr int durations = 24;
    static constexpr double shortest = 0.6;      // in the time that stopping takes at a large acceleration
    static constexpr double longer = 1.1192072;  // factor from one duration to the next: the last is 8
    // How much further than for the least cost it ends, in the way that the speed of the start makes meanwhile.
    static constexpr int ends = 3;
    static constexpr double reaches[ends] = {0.0, -0.12, 0.12};
    static constexpr int instants = 25;       // at which a member is looked at before it is proved
    static constexpr double inwards = 1e-4;   // by how many widths it must be inside at its end then, in proportion before
    static constexpr double outwards = 5e-5;  // and by how many its start may be outside
    static constexpr double across = 1e-9;    // component along a leg below which a wall is along it
    static constexpr double kept = 1e-9;      // share by which a limit may be exceeded, as in compliance.py
};

}  // namespace minsnap

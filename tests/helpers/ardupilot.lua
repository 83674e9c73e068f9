-- Stands in for ArduCopter's scripting engine: lua5.3 ardupilot.lua SCRIPT SECONDS [EVENT ...], an event being TIME=LUA.
-- The vehicle follows its setpoints with a lag of a tenth of a second. Prints what the script says, and a row for each setpoint.
local vector = {}
vector.__index = vector
for i, axis in ipairs({"x", "y", "z"}) do
  vector[axis] = function(self, value) if value then self[i] = value end return self[i] end
end
function vector:length() return math.sqrt(self[1] ^ 2 + self[2] ^ 2 + self[3] ^ 2) end
function Vector3f() return setmetatable({0, 0, 0}, vector) end

local clock = {}
clock.__index = clock
clock.__sub = function(a, b) return setmetatable({ms = a.ms - b.ms}, clock) end
function clock:tofloat() return self.ms end

world = {now = 0, mode = 4, armed = true, switch = 0, here = Vector3f(), speed = Vector3f(), takes = true}
local wanted

function millis() return setmetatable({ms = world.now}, clock) end
gcs = {send_text = function(_, level, text) print("say", world.now / 1000, level, text) assert(#text <= 50, "a message of 50 bytes at most") end}
rc = {get_aux_cached = function(_, option) assert(option == 300) return world.switch end}
param = {get = function(_, name) assert(name == "SCR_USER1") return 0 end}
arming = {is_armed = function() return world.armed end}
ahrs = {
  get_relative_position_NED_origin = function() return world.here end,
  get_velocity_NED = function() return world.speed end,
}
vehicle = {
  get_mode = function() return world.mode end,
  set_mode = function(_, mode) world.mode = mode print("mode", world.now / 1000, mode) return true end,
  set_target_posvelaccel_NED = function(_, p, v, a, use_yaw, yaw, use_rate, rate, relative)
    assert(use_yaw and use_rate and not relative)
    if world.mode ~= 4 or not world.takes then return false end
    wanted = p
    print(string.format("set\t%.3f" .. string.rep("\t%.17g", 11), world.now / 1000, p[1], p[2], p[3], v[1], v[2], v[3], a[1], a[2], a[3], yaw, rate))
    return true
  end,
}

local events = {}
for i = 3, #arg do
  local time, code = arg[i]:match("^([^=]*)=(.*)$")
  events[#events + 1] = {1000 * tonumber(time), load(code)}
end
local step, wait = assert(loadfile(arg[1]))()
local due = wait
while world.now <= 1000 * tonumber(arg[2]) do
  for _, event in ipairs(events) do
    if event[1] == world.now then event[2]() end
  end
  if world.now >= due then
    step, wait = step()
    due = world.now + wait
  end
  if wanted and world.here and world.mode == 4 then
    for i = 1, 3 do world.here[i] = world.here[i] + (wanted[i] - world.here[i]) * 0.1 end
  end
  world.now = world.now + 10
end

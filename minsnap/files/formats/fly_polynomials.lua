-- Needs Copter 4.4 or newer: SCR_ENABLE 1, this file in APM/scripts, a restart.
-- The flight begins when the switch goes from low to high (RCx_OPTION 300, or SCR_USER1 set to 1), armed, in GUIDED, at rest at the start.
-- It ends for good when the mode is left, the vehicle is disarmed, its position is lost, it is too far from the plan, or a setpoint is refused.
-- Afterwards the switch must be low once before the script flies again. No link is needed.

local GUIDED, BRAKE, SWITCH = 4, 17, 300
local PERIOD_MS = 20
local AT_START_M, AT_REST_M_S, STEADY_S = 0.15, 0.2, 1.0 -- how near, how slow and for how long before the flight begins
local SILENCE_S = 0.5 -- longest time between two setpoints, and without a position
local INFO, WARNING = 6, 4

local state = "locked" -- until the switch was low; then "ready", "waiting", "flying", "holding"
local began, steady, last, seen
local north0, east0, down0 = 0, 0, 0
local at, piece_start = 1, 0

local function seconds(from) return (millis() - from):tofloat() * 0.001 end

local function say(level, text) gcs:send_text(level, "minsnap: " .. text) end

local function is_on()
  if rc:get_aux_cached(SWITCH) == 2 then return true end
  return param:get("SCR_USER1") == 1
end

-- Value and two derivatives at s seconds of the polynomial whose N + 1 ascending coefficients stand behind an index.
local function at_seconds(row, index, s)
  local p, v, a = 0, 0, 0
  for i = index + DEGREE, index, -1 do
    a = a * s + 2 * v
    v = v * s + p
    p = p * s + row[i]
  end
  return p, v, a
end

-- Go on to the piece of an instant; the seconds since it began.
local function piece_at(t)
  while at < #PIECES and t >= piece_start + PIECES[at][1] do
    piece_start = piece_start + PIECES[at][1]
    at = at + 1
  end
  return PIECES[at], math.min(t - piece_start, PIECES[at][1])
end

local function setpoint(t)
  local row, s = piece_at(t)
  local position, velocity, acceleration = Vector3f(), Vector3f(), Vector3f()
  local count = DEGREE + 1
  local x, vx, ax = at_seconds(row, 2, s)
  local y, vy, ay = at_seconds(row, 2 + count, s)
  local z, vz, az = at_seconds(row, 2 + 2 * count, s)
  local heading, turn = HEADING, 0
  if #row > 1 + 3 * count then heading, turn = at_seconds(row, 2 + 3 * count, s) end
  position:x(x + north0) position:y(y + east0) position:z(z + down0)
  velocity:x(vx) velocity:y(vy) velocity:z(vz)
  acceleration:x(ax) acceleration:y(ay) acceleration:z(az)
  return position, velocity, acceleration, heading % 360, turn
end

local function send(t)
  local position, velocity, acceleration, heading, turn = setpoint(t)
  last = millis()
  return vehicle:set_target_posvelaccel_NED(position, velocity, acceleration, true, heading, true, turn, false), position
end

local function stop(reason)
  state = "locked"
  say(WARNING, reason)
  if arming:is_armed() and vehicle:get_mode() == GUIDED then vehicle:set_mode(BRAKE) end
end

local function distance(here, there)
  local north, east, down = here:x() - there:x(), here:y() - there:y(), here:z() - there:z()
  return math.sqrt(north * north + east * east + down * down)
end

-- Whether the vehicle has been at rest at the start for long enough; what it waits for is said once.
local function is_ready()
  local here, speed = ahrs:get_relative_position_NED_origin(), ahrs:get_velocity_NED()
  if not (arming:is_armed() and vehicle:get_mode() == GUIDED and here and speed) then
    steady = nil
    return false
  end
  at, piece_start, north0, east0, down0 = 1, 0, 0, 0, 0
  local start = setpoint(0)
  if FROM_HERE then
    north0, east0, down0 = here:x() - start:x(), here:y() - start:y(), here:z() - start:z()
  elseif distance(here, start) > AT_START_M then
    steady = nil
    return false
  end
  steady = speed:length() <= AT_REST_M_S and (steady or millis()) or nil
  if not steady then return false end
  return seconds(steady) >= STEADY_S
end

local function fly()
  local t = seconds(began)
  if vehicle:get_mode() ~= GUIDED then return stop(state == "holding" and "the hold is over" or "stopped, the mode was left") end
  if not arming:is_armed() then return stop("stopped, disarmed") end
  if seconds(last) > SILENCE_S then return stop("stopped, the script was held up") end
  local here = ahrs:get_relative_position_NED_origin()
  if here then seen = millis() elseif seconds(seen) > SILENCE_S then return stop("stopped, no position") end
  local accepted, wanted = send(math.min(t, DURATION))
  if not accepted then return stop("stopped, a setpoint was refused") end
  local off = here and distance(here, wanted) or 0
  if off > ABORT_DISTANCE then return stop(string.format("stopped, %.1f m off", off)) end
  if state == "flying" and t >= DURATION then
    state = "holding"
    say(INFO, "flown; holds until the mode is changed")
  end
end

local function update()
  if state == "locked" then
    if not is_on() then state = "ready" end
  elseif state == "ready" then
    if is_on() then
      state, steady = "waiting", nil
      say(INFO, "waits at the start, armed, in GUIDED")
    end
  elseif not is_on() and state == "waiting" then
    state = "ready"
  elseif state == "waiting" then
    if is_ready() then
      state, began, last, seen = "flying", millis(), millis(), millis()
      say(INFO, string.format("flies %.1f s", DURATION))
      fly()
    end
  else
    fly()
  end
  return update, PERIOD_MS
end

say(INFO, string.format("%d polynomials, %.1f s", #PIECES, DURATION))
return update, 1000

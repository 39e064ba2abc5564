-- MATLAB files byte by byte (MAT-file level 5): full, sparse, nested and damaged ones.
local file = os.tmpname() .. ".mat"
local text_header = ("MATLAB 5.0 MAT-file" .. (" "):rep(124)):sub(1, 124) .. string.pack("<I2", 0x0100)
  .. "IM"
local int8, int32, uint32, double, matrix = 1, 5, 6, 9, 14

local function element(kind, bytes)
  return string.pack("<I4I4", kind, #bytes) .. bytes .. ("\0"):rep(-#bytes % 8)
end
local function numbers(format, list) return string.pack("<" .. format:rep(#list), table.unpack(list)) end

local function array(name, class, rows, cols, parts, nzmax)
  return element(matrix, element(uint32, string.pack("<I4I4", class, nzmax or 0))
    .. element(int32, numbers("i4", { rows, cols })) .. element(int8, name) .. table.concat(parts))
end
local function full(name, rows, cols, list)
  return array(name, 6, rows, cols, { element(double, numbers("d", list)) })
end
local function sparse(name, rows, cols, ir, jc, list)
  return array(name, 5, rows, cols, { element(int32, numbers("i4", ir)), element(int32, numbers("i4", jc)),
    element(double, numbers("d", list)) }, #list)
end

local function write(bytes)
  local out = assert(io.open(file, "wb"))
  out:write(bytes)
  out:close()
end

local function read(bytes, columns)
  write(bytes)
  return iddata.read(file, columns)
end

test("a full matrix is read as columns", function()
  local d = read(text_header .. full("y", 4, 1, { 1, 2, 3, 4 }) .. full("u", 4, 1, { 5, 6, 7, 8 }),
    { y = "y", u = "u", Ts = 1 })
  expect(d.y[3]):equals(3)
  expect(d.u[4]):equals(8)
end)

test("a sparse matrix is read as the matrix it stands for", function()
  local d = read(text_header .. sparse("m", 4, 2, { 1, 3, 0 }, { 0, 2, 3 }, { 10, 30, 7 }),
    { y = "m1", u = "m2", Ts = 1 })
  for i, value in ipairs { 0, 10, 0, 30 } do expect(d.y[i]):equals(value) end
  for i, value in ipairs { 7, 0, 0, 0 } do expect(d.u[i]):equals(value) end
  local empty = read(text_header .. sparse("m", 3, 1, {}, { 0, 0 }, {}), { y = "m", Ts = 1 })
  expect(empty.y[2]):equals(0)
end)

test("an array that is larger than its file is refused before memory is asked for", function()
  for _, rows in ipairs { 268435460, 2147483647, 1000000 } do
    local bytes = text_header .. array("y", 6, rows, 1, { element(double, numbers("d", { 1, 2, 3, 4 })) })
    expect(function() read(bytes, { y = "y", Ts = 1 }) end):fails "damaged"
  end
end)

-- An element whose tag says another length than it has.
local function claimed(kind, length, bytes)
  return string.pack("<I4I4", kind, length) .. bytes .. ("\0"):rep(-#bytes % 8)
end
local function from_hex(text)
  return (text:gsub("%s", ""):gsub("..", function(pair) return string.char(tonumber(pair, 16)) end))
end
local function compressed(hex)
  local bytes = from_hex(hex)
  return string.pack("<I4I4", 15, #bytes) .. bytes
end

test("whatever kind of array says that it is gigabytes long is refused at once", function()
  local four = 0xFFFFFFF0  -- bytes
  local flags = function(class) return element(uint32, string.pack("<I4I4", class, 3)) end
  local dims = function(rows, cols) return element(int32, numbers("i4", { rows, cols })) end
  local m = element(int8, "m")
  local jc, data = element(int32, numbers("i4", { 0, 2, 3 })), element(double, numbers("d", { 10, 30, 7 }))
  local rows = element(int32, numbers("i4", { 1, 3, 0 }))
  local width = element(int32, string.pack("<i4", 8))  -- of names of fields
  local field = "a" .. ("\0"):rep(7)
  local cases = {
    ["row numbers"] = flags(5) .. dims(4, 2) .. m
      .. claimed(int32, four, numbers("i4", { 1, 3, 0, 0 })) .. jc .. data,
    ["beginnings of columns"] = flags(5) .. dims(4, 2) .. m .. rows
      .. claimed(int32, four, numbers("i4", { 0, 2 })) .. data,
    ["entries"] = flags(5) .. dims(4, 2) .. m .. rows .. jc
      .. claimed(double, four, numbers("d", { 1, 2 })),
    ["sparse columns"] = flags(5) .. dims(4, 0x1FFFFFFF) .. m .. rows .. jc .. data,
    ["numbers"] = flags(6) .. dims(4, 1) .. m .. claimed(double, four, numbers("d", { 1, 2 })),
    ["cells"] = flags(1) .. dims(0x7FFFFFF, 1) .. m .. full("", 1, 1, { 1 }),
    ["structures"] = flags(2) .. dims(0x7FFFFFF, 1) .. m .. width .. element(int8, field)
      .. full("", 1, 1, { 1 }),
    ["names of fields"] = flags(2) .. dims(1, 1) .. m .. width .. claimed(int8, four, field),
    ["a field"] = flags(2) .. dims(1, 1) .. m .. width .. element(int8, field)
      .. claimed(matrix, four, flags(6) .. dims(0x7FFFFFF, 1) .. element(int8, "")),
    ["characters"] = flags(4) .. dims(0x7FFFFFF, 1) .. m .. claimed(4, four, "abcdefgh"),
  }
  local begin = os.time()
  for name, body in pairs(cases) do
    write(text_header .. element(matrix, body))
    local good, message = pcall(iddata.read, file, { y = "m1", Ts = 1 })
    if good or not tostring(message):find(file, 1, true) then error(name .. ": " .. tostring(message), 0) end
    write(text_header .. claimed(matrix, four, body))
    if pcall(iddata.read, file, { y = "m1", Ts = 1 }) then error(name .. ", itself of 4 GB, is read", 0) end
  end
  -- the first case, compressed
  write(text_header .. compressed [[78dae36360608800623620e6006256206686d2203e0b103301312314e732400048fec3ff
ffff19a1ea1990c479a06c2624394e209680ab527180d076505ac60100bdd10692]])
  expect(function() iddata.read(file, { y = "m1", Ts = 1 }) end):fails(file)
  local level4 = string.pack("<i4i4i4i4i4", 0, 0x7FFFFFF, 3, 0, 2) .. "y\0" .. numbers("d", { 1, 2, 3 })
  write(level4)
  expect(function() iddata.read(file, { y = "y1", Ts = 1 }) end):fails(file)
  expect(os.difftime(os.time(), begin) <= 10):equals(true)  -- 22 files; one alone took 12 s
end)

test("compressed elements", function()
  local d = read(text_header .. compressed [[78dae36360608800623620e680d220c00ae5b300312312ae84ca7302b1020
30c7cb087321c2014079416700000734f0338]], { y = "y", Ts = 1 })
  expect(d.y[4]):equals(4)
end)

test("a file that ends inside a variable is refused, not read up to there", function()
  local bytes = text_header .. full("y", 4, 1, { 1, 2, 3, 4 }) .. full("u", 4, 1, { 5, 6, 7, 8 })
  expect(read(bytes, { y = "y", Ts = 1 }).y[4]):equals(4)
  expect(function() read(bytes:sub(1, -9), { y = "y", Ts = 1 }) end):fails "damaged"
end)

test("indices that lead out of a sparse matrix are an error", function()
  for _, case in ipairs { { { 1, 9, 0 }, { 0, 2, 3 } }, { { 1, -1, 0 }, { 0, 2, 3 } },
    { { 1, 3, 0 }, { 0, 9, 3 } },
    { { 1, 3, 0 }, { 0, 3, 2 } }, { { 1, 3, 0 }, { 0, 2 } }, { { 1, 3, 0 }, { 0, -5, 3 } } } do
    expect(function() read(text_header .. sparse("m", 4, 2, case[1], case[2], { 10, 30, 7 }),
      { y = "m1", Ts = 1 }) end)
      :fails(file)
  end
end)

test("damaged files: an error that names the file, or data, and never an internal error", function()
  local good = text_header .. full("y", 4, 1, { 1, 2, 3, 4 })
    .. sparse("m", 4, 2, { 1, 3, 0 }, { 0, 2, 3 }, { 10, 30, 7 })
    .. full("u", 2, 4, { 1, 2, 3, 4, 5, 6, 7, 8 })
  local seed = 3
  local function random(n)
    seed = (seed * 1103515245 + 12345) % 2147483648
    return (seed >> 8) % n + 1
  end
  for n = 1, 60 do
    local bytes = good
    for _ = 1, random(3) do
      local at = 128 + random(#bytes - 128)
      bytes = bytes:sub(1, at - 1) .. string.char(random(256) - 1) .. bytes:sub(at + 1)
    end
    if n % 5 == 0 then bytes = bytes:sub(1, 128 + random(#bytes - 128)) end
    write(bytes)
    local read_it, message = pcall(iddata.read, file, { y = "y", Ts = 1 })
    if not read_it and tostring(message):find("internal error", 1, true) then error(message, 0) end
  end
  expect(true):equals(true)
end)

os.remove(file)

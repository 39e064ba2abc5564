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

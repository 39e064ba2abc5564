-- Random points and renamings, by which the grader compares functions and models.

local points = {}

-- A sequence of its own (Park and Miller, 1988), so that a verdict does not depend on anything else.
function points.generator(seed)
  local state = seed
  return function(low, high)
    state = state*48271 % 2147483647
    return low + (high - low)*state/2147483647
  end
end

-- The value of e where its symbols, by name, are those in `at`; nan where it has none.
function points.value_at(e, at)
  if type(e) == "number" then return e end
  local inside = {}
  for _, name in ipairs(leaves_of { e }) do inside[name] = at[name] end
  local good, value = pcall(evaluate, e, inside)
  return good and type(value) == "number" and value or 0/0
end

-- Has e branches, so that it can be one function here and another one elsewhere?
function points.branches(e)
  if type(e) == "number" then return false end
  local code = e:code()
  for word in ("ifelse abs sign min max floor ceil round mod heaviside saturate"):gmatch "%w+" do
    if code:find("%f[%w_]" .. word .. "%f[^%w_]") then return true end
  end
  return false
end

-- The names of several lists, each once, in order.
function points.union(...)
  local set, list = {}, {}
  for _, names in ipairs { ... } do
    for _, name in ipairs(names) do
      if not set[name] then list[#list + 1] = name end
      set[name] = true
    end
  end
  table.sort(list)
  return list
end

-- The permutations of 1 … n, one after the other; the list is the same table every time.
function points.permutations(n)
  local list = {}
  for i = 1, n do list[i] = i end
  local function go(k)
    if k >= n then return coroutine.yield(list) end
    for i = k, n do
      list[k], list[i] = list[i], list[k]
      go(k + 1)
      list[k], list[i] = list[i], list[k]
    end
  end
  return coroutine.wrap(function() go(1) end)
end

local most = 6                    -- names that are exchanged: 720 ways

-- The ways to call the names of one list by those of another: names of both stay, the others are paired in
-- every way; with any_names all are. nil where there is none.
function points.renamings(of_a, of_b, any_names)
  local shared, only_a, only_b = {}, {}, {}
  for _, name in ipairs(of_b) do shared[name] = not any_names end
  for _, name in ipairs(of_a) do
    if shared[name] then shared[name] = 2 else only_a[#only_a + 1] = name end
  end
  for _, name in ipairs(of_b) do
    if shared[name] ~= 2 then only_b[#only_b + 1] = name end
  end
  local ways = {}
  if #only_a ~= #only_b or #only_a > most then return ways end
  for order in points.permutations(#only_a) do
    local names = {}
    for i, name in ipairs(only_a) do names[name] = only_b[order[i]] end
    ways[#ways + 1] = names
  end
  return ways
end

return points

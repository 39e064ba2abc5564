-- Random networks in which every part of a library occurs: what enters through the ports of a part is stored,
-- lost or given as its own law says, and what it cannot keep (charge, volume) leaves again. Every node stores
-- something, so that any part may be anywhere. ledger_test.lua runs a few seeds, ./dev networks many.
local network = dofile "tests/parts/ledger/network.lua"
local random = math.random
local M = { domains = {} }
local domains = { "electrical", "translational", "rotational", "thermal", "hydraulic", "planar", "spatial",
  "process", "signals" }
for _, domain in ipairs(domains) do
  M.domains[domain] = dofile("tests/parts/ledger/" .. domain .. ".lua")
end

-- Names of the parts of a library.
function M.parts(domain)
  local names = {}
  for name, part in components[domain]() do
    if getmetatable(part) == "component" then names[#names + 1] = name end
  end
  return names
end

-- The faults of the network with this seed: 3 to 50 parts, beginning at another place of the list every time.
-- Returns them and the names of the parts in it.
function M.trial(domain, seed)
  math.randomseed(seed)
  local kind = M.domains[domain]
  local names = M.parts(domain)
  local net = network.new(kind.nodes or 2 + random(5))
  net.guess = {}
  kind.prepare(net)
  local first, used = random(#names), {}
  for k = 1, 3 + random(math.min(kind.parts or 20, #names)) do
    local name = names[(first + k) % #names + 1]
    if name ~= "ground" then kind.recipes[name](net, ("x%d"):format(k)) end
    used[name] = true
  end
  return net:faults(kind.to, { guess = net.guess, placed = kind.placed }), used
end

-- pendula tests/parts/ledger.lua [seeds]: every domain; what does not balance is printed.
if arg and arg[0] and arg[0]:find "ledger.lua$" then
  local seeds, wrong = tonumber(arg[1]) or 200, 0
  for _, domain in ipairs(domains) do
    for seed = 1, seeds do
      local done, faults = pcall(M.trial, domain, seed)
      if not done then faults = { tostring(faults) } end
      if #faults > 0 then
        wrong = wrong + 1
        print(domain, "seed " .. seed, table.concat(faults, "; "))
      end
    end
  end
  print(("%d networks, %d with faults"):format(#domains*seeds, wrong))
  if wrong > 0 then os.exit(1) end
end

return M

-- Sweeps on other machines: shards given to Slurm, followed, collected, submitted again where they were lost.
-- Nothing of ours runs there but `pendula shard runs.db.d/17`, once for every task of a job array.

local cluster = {}
local seconds = { first = 0.5, most = 10 }           -- between two looks at the queue
local most_shards = 1000                             -- the largest number in an array: MaxArraySize is 1001

local function quoted(text) return "'" .. text:gsub("'", "'\\''") .. "'" end

-- What a command prints, or nil and what it says.
local function output(command)
  local pipe = io.popen(command .. " 2>&1", "r")
  local text = pipe:read "a"
  local good = pipe:close()
  if good then return text end
  return nil, text
end

local function require_slurm()
  for _, name in ipairs { "sbatch", "squeue", "scancel" } do
    if not output("command -v " .. name) then
      fail(("sweep: there is no program '%s' here; on = slurm{ … } needs a login node of a cluster with "
        .. "Slurm (Debian: "
        .. "slurm-client). Shards can be run by hand too: shards = 64"):format(name))
    end
  end
end

-- ── the options of slurm{ … } ──────────────────────────────────────────────────────────────────────────────

function cluster.read(options)
  for _, key in ipairs { "modules", "options" } do
    if type(options[key]) == "string" then options[key] = { options[key] } end
  end
  for _, key in ipairs { "tasks", "shards", "cpus" } do
    if options[key] and (math.type(options[key]) ~= "integer" or options[key] < 1) then
      fail(("slurm: %s = %s; it must be a whole number of at least 1"):format(key, tostring(options[key])))
    end
  end
  if (options.shards or 0) > most_shards then
    fail(("slurm: shards = %d; a job array is numbered up to %d"):format(options.shards, most_shards))
  end
  return options
end

-- ── the job ────────────────────────────────────────────────────────────────────────────────────────────────

-- 1 2 3 5 -> "1-3,5"
local function list_text(numbers)
  local parts, i = {}, 1
  while i <= #numbers do
    local j = i
    while numbers[j + 1] == numbers[j] + 1 do j = j + 1 end
    parts[#parts + 1] = i == j and tostring(numbers[i]) or numbers[i] .. "-" .. numbers[j]
    i = j + 1
  end
  return table.concat(parts, ",")
end

local function script(folder, on)
  local lines = { "#!/bin/sh", "#SBATCH --requeue" }
  local function add(option, value) lines[#lines + 1] = ("#SBATCH --%s=%s"):format(option, value) end
  add("job-name", "pendula")
  add("output", folder .. "/log.%a.%A")
  if on.partition then add("partition", on.partition) end
  if on.account then add("account", on.account) end
  if on.memory then add("mem", on.memory) end
  if on.cpus then add("cpus-per-task", on.cpus) end
  if on.time then add("time", (on.time:gsub("^(%d+)h$", "%1:00:00"):gsub("^(%d+)min$", "%1"))) end
  for _, option in ipairs(on.options or {}) do lines[#lines + 1] = "#SBATCH " .. option end
  for _, module in ipairs(on.modules or {}) do lines[#lines + 1] = "module load " .. module end
  lines[#lines + 1] = ("exec %s shard %s/$SLURM_ARRAY_TASK_ID"):format(quoted(on.program or shards.program()),
    quoted(folder))
  return table.concat(lines, "\n") .. "\n"
end

-- Submits shards as one array; its number.
local function submit(folder, on, numbers)
  write_file(folder .. "/job.sh", script(folder, on), "slurm")
  local array = list_text(numbers) .. (on.tasks and "%" .. on.tasks or "")
  local text, why = output(("sbatch --parsable --array=%s %s"):format(array, quoted(folder .. "/job.sh")))
  local job = text and text:match "(%d+)[^\n]*%s*$"
  if not job then fail("slurm: sbatch refused the job: " .. ((why or text):gsub("%s+$", ""))) end
  return job
end

-- The tasks of our jobs that wait or run: by shard number. nil where squeue does not answer.
local function active_tasks(jobs)
  local found = {}
  if #jobs == 0 then return found end
  local text = output(("squeue -h -r -j %s -o '%%F %%K %%T %%r'"):format(table.concat(jobs, ",")))
  if not text then
    text = output "squeue -h -r --me -o '%F %K %T %r'"     -- none of the jobs is known any more
    if not text then return nil end
  end
  local ours = {}
  for _, job in ipairs(jobs) do ours[job] = true end
  for job, task, state, reason in text:gmatch "(%d+) (%d+) (%S+) (%S*)" do
    if ours[job] then
      found[tonumber(task)] = true
      if state == "PENDING" and reason == "BeginTime" then    -- started again after its node was lost: now
        output(("scontrol update jobid=%s_%s StartTime=now"):format(job, task))
      end
    end
  end
  return found
end

-- ── following ──────────────────────────────────────────────────────────────────────────────────────────────

local function words(text)
  local list = {}
  for word in text:gmatch "%S+" do list[#list + 1] = word end
  return list
end

-- Shards that nobody works on any more are submitted again, at most `retries` times each.
local function submit_lost(file, folder, on, state)
  local jobs = words(shards.note(file, "jobs"))
  local active = active_tasks(jobs)
  if not active then return jobs end
  local lost, given_up = {}, {}
  for _, number in ipairs(state.open) do
    if not active[number] then
      local tries = tonumber(shards.note(file, "tries " .. number)) or 0
      if tries > (on.retries or 3) then given_up[#given_up + 1] = number else lost[#lost + 1] = number end
    end
  end
  if #given_up > 0 and #given_up == #state.open then
    fail(("slurm: the shards %s were started %d times and never finished; the reasons are in %s/log.*. "
      .. "The finished runs are in %s"):format(list_text(given_up), (on.retries or 3) + 1, folder, file))
  end
  -- A shard that has just finished is neither in the queue nor in what was read before it: look again.
  if #lost > 0 then
    local still = {}
    for _, number in ipairs(shards.collect(file).open) do still[number] = true end
    for i = #lost, 1, -1 do
      if not still[lost[i]] then table.remove(lost, i) end
    end
  end
  if #lost > 0 then
    jobs[#jobs + 1] = submit(folder, on, lost)
    shards.note(file, "jobs", table.concat(jobs, " "))
    for _, number in ipairs(lost) do
      local tries = tonumber(shards.note(file, "tries " .. number)) or 0
      shards.note(file, "tries " .. number, tostring(tries + 1))
    end
  end
  return jobs
end

-- One line on the terminal, written over again; nothing where there is none.
local function progress(text)
  if os.execute "test -t 2" then io.stderr:write("\r", text, "\27[K") end
end

-- Shards that nobody has been asked to make: takes what is finished, and says what is not.
local function follow_by_hand(file)
  local state = shards.collect(file)
  local missing = state.open[1]
  if missing then
    io.stderr:write(("sweep: %d of %d shards are not finished; each is made by pendula shard %s.d/%d\n")
      :format(#state.open, state.shards, file, missing))
  end
end

-- Until all shards are collected.
function cluster.follow(file)
  if shards.note(file, "on") == "" then return follow_by_hand(file) end
  require_slurm()
  local folder = file .. ".d"
  local on = include "saved" (shards.note(file, "on"), file)
  local pause = seconds.first
  while true do
    local state = shards.collect(file)
    progress(("sweep: %d of %d runs, %d of %d shards (Ctrl-C: the cluster continues; attach %q returns to it)")
      :format(state.done + state.failed, state.runs, state.shards - #state.open, state.shards, file))
    if #state.open == 0 then break end
    submit_lost(file, folder, on, state)
    io.popen("sleep " .. pause):close()
    pause = math.min(1.5*pause, seconds.most)
  end
  progress ""
  cluster.cancel(file)                                   -- duplicates that still wait
end

-- For others, by hand.
function cluster.write(file, count)
  shards.write(file, count)
end

function cluster.run_shard(path, workers)
  local folder, read_saved = path:match "^(.*)/[^/]*$" or ".", include "saved"
  local function read(name, locals)
    local file = io.open(folder .. "/" .. name, "rb")
      or fail(("shard: there is no '%s/%s'; a shard is written runs.db.d/17"):format(folder, name))
    local text = file:read "a"
    file:close()
    return read_saved(text, folder .. "/" .. name, locals)
  end
  local sys = read "model.lua"
  local options = read("options.lua", { sys = sys })
  options.workers = workers
  return shards.make(sys, options, path)
end

-- Writes shards where there are none yet and follows them.
function cluster.run(file, on)
  on = contents("slurm", on)
  require_slurm()
  if shards.note(file, "on") == "" then
    local parts = {}
    for key, value in pairs(on) do
      if type(value) == "table" then
        local items = {}
        for i, item in ipairs(value) do items[i] = ("%q"):format(item) end
        value = "{" .. table.concat(items, ", ") .. "}"
      elseif type(value) == "string" then
        value = ("%q"):format(value)
      end
      parts[#parts + 1] = key .. " = " .. tostring(value)
    end
    table.sort(parts)
    shards.write(file, on.shards or math.min(on.tasks or 16, most_shards))
    shards.note(file, "on", "return { " .. table.concat(parts, ", ") .. " }\n")
  end
  cluster.follow(file)
end

function cluster.cancel(file)
  local jobs = words(shards.note(file, "jobs"))
  if #jobs > 0 then output("scancel -Q " .. table.concat(jobs, " ")) end
  return #jobs
end

-- One line on how far a sweep is.
function cluster.status(file)
  local info = store_info(file)
  local lines = { ("%s: %d of %d runs finished, %d of them failed"):format(file, info.done + info.failed,
    info.runs,
    info.failed) }
  local jobs = words(shards.note(file, "jobs"))
  if #jobs > 0 then
    local active, count = output "command -v squeue" and active_tasks(jobs), 0
    for _ in pairs(active or {}) do count = count + 1 end
    lines[#lines + 1] = active and ("Slurm: %d tasks wait or run (jobs %s)"):format(count,
      table.concat(jobs, ", "))
      or "Slurm does not answer"
  end
  return table.concat(lines, "\n")
end

return cluster

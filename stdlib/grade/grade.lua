-- The grader: a teacher's file of tasks, answers as data, verdicts. Called by src/lua/session/answers.cpp.

local values, compare = include "grade/values", include "grade/compare"
local grade = { text_of = values.text_of }
local tasks, by_name, title = {}, {}, ""

local options = { name = "string", points = "number", text = "string", tolerance = "number", range = "table",
  any_order = "boolean", any_names = "boolean", right = "string", wrong = "string", mistakes = "table",
  check = "function",
  least = "number", fit = true, answer = true }

local function add_task(given)
  if type(given) ~= "table" then
    fail 'task: expected a table, as in task { "speed", points = 2, answer = 3.5 }'
  end
  local task = {}
  for key, value in pairs(given) do
    local kind = key == 1 and "string" or options[key]
    if not kind then
      fail(("task: unknown option '%s' (options: answer, any_names, any_order, check, fit, least, mistakes, "
        .. "name, points, range, right, text, tolerance, wrong)"):format(tostring(key)))
    end
    if kind ~= true and type(value) ~= kind then
      fail(("task: option '%s': expected a %s, got a %s"):format(tostring(key), kind, type(value)))
    end
    task[key == 1 and "name" or key] = value
  end
  local name = task.name
  if not name or not name:find "^[%a_][%w_]*$" then
    fail 'task: the name is that of a global variable, as in task { "speed", … }'
  end
  if by_name[name] then fail(("task: '%s' is there twice"):format(name)) end
  if rawget(pendula, name) ~= nil or rawget(_G, name) ~= nil then
    fail(("task: '%s' is a word of the vocabulary; choose another name"):format(name))
  end
  if task.answer == nil and not task.check and not task.fit then
    fail(("task '%s': give an answer, a check, or data as fit"):format(name))
  end
  task.points = task.points or 1
  by_name[name], tasks[#tasks + 1] = task, task
end

-- Runs the teacher's file; a list of { name, points, text }.
function grade.tasks(source, file)
  local environment = setmetatable({ task = add_task, title = function(text) title = tostring(text) end },
    { __index = _G })
  local chunk, why = load(source, "@" .. file, "t", environment)
  if not chunk then fail(why) end
  chunk()
  if #tasks == 0 then fail(file .. ': there is no task; write task { "speed", points = 2, answer = 3.5 }') end
  local list = { { "title", title } }
  for _, task in ipairs(tasks) do
    list[#list + 1] = { task.name, ("%.17g"):format(task.points), task.text or "" }
  end
  return list
end

local function points_text(points) return ("%.17g"):format(points) end

local function known_mistake(task, answer)
  for _, mistake in ipairs(task.mistakes or {}) do
    if compare.same(answer, mistake.answer, task) then return mistake end
  end
end

local function judge_fit(task, answer)
  if type(answer) ~= "table" then return "wrong", 0, "a model of data was expected, as arx(d, …) gives it" end
  local good, percent = pcall(include "grade/fit".percent, answer, task.fit)
  if not good then return "wrong", 0, tostring(percent) end
  local least = task.least or 80
  if percent >= least then return "right", task.points, ("fit %.2f %%"):format(percent) end
  return "wrong", 0, ("fit %.2f %%, wanted %g %%"):format(percent, least)
end

local function judge_check(task, answer)
  local share, words = task.check(answer)
  if type(share) == "boolean" then share = share and 1 or 0 end
  if type(share) ~= "number" or share ~= share then
    fail "the check of the task gives no share between 0 and 1"
  end
  share = math.max(0, math.min(1, share))
  return share == 1 and "right" or share == 0 and "wrong" or "partly", share*task.points, words
end

local function judge(task, answer)
  if task.fit then return judge_fit(task, answer) end
  local verdict = task.answer ~= nil and compare.same(answer, task.answer, task)
  if verdict then return verdict, task.points, task.right end
  local mistake = known_mistake(task, answer)
  if mistake then
    local points = mistake.points or 0
    return points > 0 and "partly" or "wrong", points, mistake.feedback
  end
  if task.check then return judge_check(task, answer) end
  return "wrong", 0, task.wrong
end

-- The verdict on one answer: { name, verdict, points, of, feedback }.
function grade.answer(name, text)
  local task = by_name[name]
  if text == "" then
    return { { name, "wrong", "0", points_text(task.points), "a value of this kind cannot be an answer" } }
  end
  local good, answer = pcall(values.read, text)
  if not good then
    local why = "the answer cannot be read: " .. tostring(answer)
    return { { name, "wrong", "0", points_text(task.points), why } }
  end
  local done, verdict, points, words = pcall(judge, task, answer)
  if not done then
    return { { name, "error", "0", points_text(task.points),
      "could not be compared: " .. tostring(verdict) } }
  end
  return { { name, verdict, points_text(points), points_text(task.points), tostring(words or "") } }
end

return grade

// `pendula test`: what it prints and returns for files that pass, fail, break and misbehave.
#include <doctest/doctest.h>

#include <cstdio>
#include <filesystem>
#include <fstream>

#include <unistd.h>

#include "lua/session/testing.hpp"

namespace pendula::testing_test {

namespace fs = std::filesystem;

namespace {

struct Folder {
  Folder() : path(fs::temp_directory_path() / ("pendula_testing_" + std::to_string(getpid()))) {
    fs::create_directories(path / "deeper");
  }
  ~Folder() { fs::remove_all(path); }
  void write(const char* name, const char* content) const { std::ofstream(path / name) << content; }
  fs::path path;
};

struct Outcome {
  int status;
  std::string printed;  ///< with the folder's own name removed
};

/// Runs with stdout in a file.
Outcome run(const Folder& folder, const std::vector<std::string>& paths) {
  std::vector<std::string> full;
  for (const std::string& path : paths) full.push_back((folder.path / path).string());
  const fs::path captured = folder.path / "captured";
  std::fflush(stdout);
  const int terminal = dup(STDOUT_FILENO);
  std::FILE* file = std::fopen(captured.c_str(), "w");
  dup2(fileno(file), STDOUT_FILENO);
  const int status = lua::run_tests(full);
  std::fflush(stdout);
  dup2(terminal, STDOUT_FILENO);
  close(terminal);
  std::fclose(file);
  std::ifstream in(captured);
  std::string printed((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  const std::string prefix = folder.path.string() + "/";
  for (size_t at; (at = printed.find(prefix)) != std::string::npos;) printed.erase(at, prefix.size());
  return {status, printed};
}

}  // namespace

TEST_CASE("pendula test: one line per failure, then the count") {
  const Folder folder;
  folder.write("a.lua", R"(test("good", function() expect(1):equals(1) end)
test("bad", function()
  expect(1):near(2, 0.1)
  error "not reached"
end)
test("broken", function() local x = nil + 1 end)
test("swallowed", function() pcall(function() expect(1):equals(2) end) end)
expect(3):equals(4)
expect(function() error "two\nlines" end):fails "two"
test("forgotten", function() expect(1 == 2) end)
test("exit", function() os.exit(0) end)
test("thrown", function() error { 1 } end)
local function helper(v) expect(v):is_true() end
test("helper", function() helper(false) end)
undefined_thing()
)");
  folder.write("deeper/b.lua",
               "test('nested', function() test('inner', function() expect(1):equals(1) end) end)");
  folder.write("deeper/c.lua", "test('x' function() end)");
  folder.write("script.lua", "error 'has an expected output, is not a test'");
  folder.write("script.out", "");
  folder.write("note.txt", "not Lua");
  const Outcome outcome = run(folder, {""});
  CHECK(outcome.status == 1);
  CHECK(outcome.printed ==
        R"(a.lua:3: bad: expected 2 within 0.2, got 1 (off by 1)
a.lua:6: broken: attempt to perform arithmetic on a nil value
a.lua:7: swallowed: expected 2, got 1
a.lua:8: expected 4, got 3
a.lua:10: forgotten: expect(…) checks nothing by itself; add :near(b, tol), :equals(v), :fails "text" or :is_true()
a.lua:11: exit: os.exit would end the test run; return from the file instead
a.lua:12: thrown: {1}
a.lua:13: helper: expected true, got false
a.lua:15: undefined variable 'undefined_thing'.
deeper/c.lua:1: ')' expected near 'function'
4 passed, 10 failed
)");
}

TEST_CASE("pendula test: exit status") {
  const Folder folder;
  folder.write("good.lua", "test('a', function() expect('x'):equals('x') end) expect(2):is_true(nil == 1)");
  folder.write("fine.lua", "expect(2):equals(2.0) leak = 1");
  folder.write("fresh.lua", "expect(rawget(_G, 'leak')):is_nil()");
  CHECK(run(folder, {"fine.lua", "fresh.lua"}).printed == "2 passed, 0 failed\n");
  CHECK(run(folder, {"fine.lua"}).status == 0);
  CHECK(run(folder, {"good.lua"}).status == 1);
  CHECK(run(folder, {"absent.lua"}).status == 2);
  CHECK(run(folder, {"deeper"}).status == 2);
}

}  // namespace pendula::testing_test

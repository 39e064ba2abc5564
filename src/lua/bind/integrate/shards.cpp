// The library `shards`: parts of a sweep that any scheduler can run. Reads arguments, calls src/store.
#include "store/shard.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>

#include <unistd.h>

#include "base/files/draft.hpp"
#include "base/text.hpp"
#include "lua/bind/integrate/sweep_options.hpp"
#include "lua/bind/integrate/sweep_store.hpp"
#include "lua/core/library.hpp"
#include "store/run_store.hpp"

namespace pendula::lua {
namespace {

namespace fs = std::filesystem;

std::string folder_of(const std::string& file) { return file + ".d"; }

/// The missing runs as ranges.
store::Ranges missing(const std::vector<bool>& finished) {
  store::Ranges ranges;
  for (std::size_t run = 0; run < finished.size(); ++run) {
    const long r = static_cast<long>(run);
    if (finished[run]) continue;
    if (ranges.empty() || ranges.back().second != r) ranges.emplace_back(r, r);
    ++ranges.back().second;
  }
  return ranges;
}

/// Removes the first `count` runs from the ranges and returns them.
store::Ranges take(store::Ranges& ranges, long count) {
  store::Ranges taken;
  while (count > 0 && !ranges.empty()) {
    auto& [first, last] = ranges.front();
    const long some = std::min(count, last - first);
    taken.emplace_back(first, first + some);
    first += some;
    count -= some;
    if (first == last) ranges.erase(ranges.begin());
  }
  return taken;
}

/// Numbers of the shards in the folder of a store, ascending.
std::vector<long> shards_in(const std::string& folder) {
  std::vector<long> numbers;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder, none)) {
    const std::string name = entry.path().filename().string();
    const bool is_number = !name.empty() && name.find_first_not_of("0123456789") == std::string::npos;
    if (is_number) numbers.push_back(std::stol(name));
  }
  std::sort(numbers.begin(), numbers.end());
  return numbers;
}

std::string shard_path(const std::string& folder, long number) {
  return folder + "/" + std::to_string(number);
}

int write_shards(Call& call) {
  const std::string file = call.string(1, "file");
  const long count = call.integer(2, "count");
  if (count < 1 || count > 1'000'000)
    throw Error(text("count = ", count, "; it must lie between 1 and 1 000 000"));
  const store::RunStore runs(file);
  const store::Description& d = runs.description();
  if (!d.hidden.empty())
    throw Error(text("the sweep contains ", d.hidden,
                     ", Lua functions or data that cannot be sent to another process; ",
                     "write inputs as expressions of t and events with reset = { … } or action = \"stop\""));
  const std::string folder = folder_of(file);
  if (!shards_in(folder).empty())
    throw Error(text("'", folder, "' has shards already; take their results with shards.collect(\"", file,
                     "\"), or remove the folder"));
  std::error_code wrong;
  fs::create_directories(folder, wrong);
  if (wrong) throw Error("cannot make the folder '" + folder + "': " + wrong.message());
  write_file(folder + "/model.lua", d.model);
  write_file(folder + "/options.lua", d.options);
  write_file(folder + "/fingerprint", d.fingerprint);
  store::Ranges left = missing(runs.finished());
  long all = 0;
  for (const auto& [first, last] : left) all += last - first;
  long made = 0;
  for (long k = 0; k < count; ++k) {
    const long share = all * (k + 1) / count - all * k / count;
    if (share > 0) write_file(shard_path(folder, ++made), store::ranges_text(take(left, share)) + "\n");
  }
  return call.push(made);
}

std::string read_text(const std::string& name) {
  std::ifstream in(name, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Makes the runs of a shard, for the model and options at 2 and 3.
int run_shard(Call& call) {
  const std::string path = call.string(3, "shard");
  const std::string folder = fs::path(path).has_parent_path() ? fs::path(path).parent_path().string() : ".";
  const std::string fingerprint = read_text(folder + "/fingerprint");
  if (fingerprint_of(read_text(folder + "/model.lua"), read_text(folder + "/options.lua")) != fingerprint)
    throw Error(text("'", folder, "' belongs to another version of pendula than ", PENDULA_VERSION,
                     ", or its files were changed"));
  std::shared_ptr<const random::SampleSpace> space;
  const integrate::Sweep sweep(read_sweep(call, space), true);
  store::Shard shard(path, fingerprint, sweep.runs());
  if (shard.is_done()) return call.push("done before");
  if (!sweep.run_into(shard, static_cast<int>(shard.first()), static_cast<int>(shard.last()), {}))
    throw Interrupted();
  return call.push(shard.finish() ? "done" : "done by another");
}

/// Adds finished shards to the store. Adding a shard twice has no effect.
int collect(Call& call) {
  const std::string file = call.string(1, "file"), folder = folder_of(file);
  store::RunStore runs(file);
  const store::RunStore::Lock lock(runs);
  lua_State* L = call.L;
  lua_createtable(L, 0, 3);
  lua_newtable(L);  // numbers of unfinished shards
  lua_Integer open = 0;
  long shards = 0;
  for (long number : shards_in(folder)) {
    ++shards;
    const std::string path = shard_path(folder, number), done = path + ".done", key = text("shard ", number);
    if (!runs.noted(key).empty()) continue;
    if (access(done.c_str(), F_OK) != 0) {
      lua_pushinteger(L, number);
      lua_rawseti(L, -2, ++open);
      continue;
    }
    runs.add(store::read_shard(done, runs.description().fingerprint));
    runs.note(key, "collected");
  }
  lua_setfield(L, -2, "open");
  for (const auto& [key, value] :
       {std::pair{"shards", shards}, std::pair{"runs", runs.description().runs},
        std::pair{"done", runs.done()}, std::pair{"failed", static_cast<long>(runs.failed().size())}}) {
    lua_pushinteger(L, value);
    lua_setfield(L, -2, key);
  }
  return 1;
}

int note(Call& call) {
  store::RunStore runs(call.string(1, "file"));
  const std::string key = call.string(2, "key");
  if (call.has(3)) {
    runs.note(key, call.string(3, "value"));
    return 0;
  }
  return call.push(runs.noted(key));
}

/// The path of this executable, for job scripts.
int program(Call& call) {
  std::error_code wrong;
  const fs::path path = fs::read_symlink("/proc/self/exe", wrong);
  return call.push(wrong ? std::string("pendula") : path.string());
}

}  // namespace

extern const Module shards_module = {
    "sweep",
    "",
    {
        {"shards.write", write_shards, "shards.write(file, count) -> integer",
         R"(Divides the runs that are missing in a store into shards: files 1, 2, … in the folder file.d, which any process
            makes by `pendula shard runs.db.d/17` (shards.run). The number of shards.)",
         R"(
            x, k, file = var "x", param "k", os.tmpname() .. ".db"
            sys = dae{ der(x) ~ -k*x }
            options = { start = { x = 1 }, to = 1, params = { k = linspace(1, 2, 10) }, store = file, shards = 2 }
            sweep(sys, options)
            print(shards.run(file .. ".d/1"), shards.run(file .. ".d/2"), shards.collect(file).done))",
         "done done 10"},
        {"shards.make", run_shard, "shards.make(sys, options, shard) -> string",
         "Makes the runs of one shard of a sweep; shards.run reads model and options from its folder.",
         "print(type(shards.make))", "function", &sweep_option_rows()},
        {"shards.collect", collect, "shards.collect(file) -> table",
         R"(Takes the shards that are finished into the store, each once: { runs =, done =, failed =, shards =, open =
            numbers of those that are not finished }.)",
         "print(type(shards.collect))", "function"},
        {"shards.note", note, "shards.note(file, key [, value]) -> string",
         "A remark in the table `sweep` of a store; without a value the one that is there.",
         "print(type(shards.note))", "function"},
        {"shards.program", program, "shards.program() -> string", "The file of this program.",
         "print(type(shards.program()))", "string"},
    }};

}  // namespace pendula::lua

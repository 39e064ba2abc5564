// iddata: measured data. Reads arguments, calls src/sysid/data/iddata.
#include <algorithm>
#include <cmath>

#include "base/text.hpp"
#include "lua/bind/sysid/sysid.hpp"
#include "lua/core/objects.hpp"
#include "sysid/model/validation.hpp"

namespace pendula::lua {

using Eigen::Index;
using sysid::IdData;

namespace {

const IdData& data_of(Call& call) { return call.object<IdData>(1, "iddata"); }
int push(Call& call, IdData d) { return call.push(std::make_shared<const IdData>(std::move(d))); }

std::vector<std::string> words_option(Call& call, const Options& o, const char* key) {
  if (!o.has(key)) return {};
  const auto words = to_words(call.L, o.push(key), key);
  lua_settop(call.L, call.count());
  return words;
}

int make(Call& call) {
  if (!lua_istable(call.L, 1)) call.wrong(1, "data", "a table { y =, u =, Ts = }");
  const Options o = call.options(1);
  if (!o.has("y")) throw Error("y is missing; give iddata{ y = { … }, u = { … }, Ts = 1 }");
  IdData d;
  d.y = to_data(call.L, o.push("y"), "y");
  if (d.y.rows() < d.y.cols()) d.y.transposeInPlace();  // more samples than signals
  if (o.has("u")) d.u = to_data(call.L, o.push("u"), "u", d.y.rows());
  d.Ts = o.number("Ts", 1);
  d.y_names = words_option(call, o, o.has("yname") ? "yname" : "y_names");
  d.u_names = words_option(call, o, o.has("uname") ? "uname" : "u_names");
  return push(call, sysid::checked(std::move(d)));
}

int read(Call& call) {
  const std::string path = call.string(1, "file");
  const Options o = call.options(2);
  sysid::ColumnChoice choice;
  choice.y = words_option(call, o, "y");
  choice.u = words_option(call, o, "u");
  choice.Ts = o.number("Ts", 0);
  if (o.has("Ts") && !(choice.Ts > 0)) throw Error(text("Ts must be positive, got ", shortest(choice.Ts)));
  std::string ending = path.substr(path.find_last_of('.') + 1);
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  const sysid::FileColumns table = ending == "mat" ? sysid::read_mat(path) : sysid::read_table(path);
  return push(call, sysid::from_columns(table, choice, path));
}

int slice(Call& call) {
  const IdData& d = data_of(call);
  return push(call, sysid::slice(d, call.integer(2, "first"), call.integer(3, "last", d.samples())));
}

int split(Call& call) {
  auto [first, second] = sysid::split(data_of(call), call.number(2, "fraction", 0.5));
  push(call, std::move(first));
  push(call, std::move(second));
  return 2;
}

int detrend(Call& call) {
  const IdData& d = data_of(call);
  if (call.has(2) && lua_istable(call.L, 2)) {
    const Options o = call.options(2);
    const auto offsets = [&](const char* key, Index n) {
      if (!o.has(key)) return Vec(Vec::Zero(n));
      const Vec v = to_data(call.L, o.push(key), key).reshaped();
      lua_settop(call.L, call.count());
      return v;
    };
    return push(call, sysid::remove_offsets(d, offsets("y", d.outputs()), offsets("u", d.inputs())));
  }
  if (call.has(2) && lua_type(call.L, 2) == LUA_TNUMBER) {
    const long degree = call.integer(2, "trend");
    if (degree != 0 && degree != 1)
      throw Error(text("trend: 0 removes the means, 1 straight lines; got ", degree));
    return push(call, sysid::detrend(d, degree == 0 ? sysid::Trend::mean : sysid::Trend::line));
  }
  const std::string how = call.string(2, "trend", "mean");
  if (how == "mean" || how == "means" || how == "constant")
    return push(call, sysid::detrend(d, sysid::Trend::mean));
  if (how == "linear") return push(call, sysid::detrend(d, sysid::Trend::line));
  throw Error(text("unknown trend '", how, "'.", did_you_mean(how, {"mean", "linear"}),
                   " (\"mean\", \"linear\", or offsets { y = 20, u = 5 })"));
}

int resample(Call& call) {
  const bool table = call.has(2) && lua_istable(call.L, 2);
  const Options o = table ? call.options(2) : call.options(3);
  const std::string how = o.string("method", "lowpass");
  const double Ts = table ? o.number("Ts") : call.number(2, "Ts");
  if (how == "lowpass") return push(call, sysid::resample(data_of(call), Ts, sysid::Resampling::lowpass));
  if (how == "linear") return push(call, sysid::resample(data_of(call), Ts, sysid::Resampling::linear));
  if (how == "hold") return push(call, sysid::resample(data_of(call), Ts, sysid::Resampling::hold));
  throw Error(text("unknown method '", how, "'.", did_you_mean(how, {"lowpass", "linear", "hold"}),
                   " (lowpass, linear, hold)"));
}

int merge(Call& call) {
  std::vector<IdData> parts;
  for (int i = 1; i <= call.count(); ++i) parts.push_back(call.object<IdData>(i, "iddata"));
  if (parts.empty()) throw Error("merge(d1, d2, …) needs data");
  return push(call, sysid::merge(parts));
}

int fill(Call& call) {
  const std::string how = call.string(2, "method", "linear");
  if (how == "linear") return push(call, sysid::fill(data_of(call), sysid::Filling::linear));
  if (how == "previous") return push(call, sysid::fill(data_of(call), sysid::Filling::previous));
  throw Error(
      text("unknown method '", how, "'.", did_you_mean(how, {"linear", "previous"}), " (linear, previous)"));
}

std::vector<Index> wanted(Call& call, const Options& o, const char* key,
                          const std::vector<std::string>& names) {
  std::vector<Index> out;
  if (!o.has(key)) {
    for (std::size_t i = 0; i < names.size(); ++i) out.push_back(static_cast<Index>(i));
    return out;
  }
  const int at = o.push(key);
  if (lua_istable(call.L, at) && lua_rawlen(call.L, at) == 0) return out;
  for (const std::string& name : to_words(call.L, at, key)) {
    const auto found = std::find(names.begin(), names.end(), name);
    std::size_t i = static_cast<std::size_t>(found - names.begin());
    if (found == names.end()) {
      char* end = nullptr;
      const long number = std::strtol(name.c_str(), &end, 10);
      if (*end != 0 || number < 1 || number > static_cast<long>(names.size()))
        throw Error(text("there is no ", *key == 'y' ? "output" : "input", " '", name, "'.",
                         did_you_mean(name, names), " (", names.empty() ? "none" : join(names, ", "), ")"));
      i = static_cast<std::size_t>(number - 1);
    }
    out.push_back(static_cast<Index>(i));
  }
  lua_settop(call.L, call.count());
  return out;
}

int select(Call& call) {
  const IdData& d = data_of(call);
  call.table(2, "signals");
  const Options o = call.options(2);
  return push(call, sysid::select(d, wanted(call, o, "y", d.y_names), wanted(call, o, "u", d.u_names)));
}

int save(Call& call) {
  const IdData& d = data_of(call);
  const std::string path = call.string(2, "file");
  if (path.size() > 4 && path.compare(path.size() - 4, 4, ".mat") == 0)
    sysid::write_mat(d, path);
  else
    sysid::write_csv(d, path);
  return 0;
}

/// A list of { name, matrix }.
int write_matrices(Call& call) {
  const std::string path = call.string(1, "file");
  call.table(2, "matrices");
  sysid::NamedMatrices variables;
  for (lua_Integer i = 1; lua_geti(call.L, 2, i) == LUA_TTABLE; ++i) {
    const int pair = lua_gettop(call.L);
    lua_geti(call.L, pair, 1);
    const std::string name = luaL_checkstring(call.L, -1);
    lua_geti(call.L, pair, 2);
    variables.emplace_back(name, to_numeric_matrix(call.L, lua_gettop(call.L), name));
    lua_settop(call.L, pair - 1);
  }
  sysid::write_mat(variables, path);
  return 0;
}

/// { name = matrix or number }
int read_matrices(Call& call) {
  const sysid::NamedMatrices found = sysid::read_matrices(call.string(1, "file"));
  lua_createtable(call.L, 0, static_cast<int>(found.size()));
  for (const auto& [name, matrix] : found) {
    lua_pushlstring(call.L, name.data(), name.size());
    if (matrix.size() == 1) {
      lua_pushnumber(call.L, matrix(0, 0));
    } else {
      push_matrix(call.L, matrix);
    }
    lua_rawset(call.L, -3);
  }
  return 1;
}

int csv(Call& call) {
  sysid::write_csv(data_of(call), call.string(2, "file"));
  return 0;
}

int field_y(Call& call) { return push_matrix(call.L, data_of(call).y); }
int field_u(Call& call) { return push_matrix(call.L, data_of(call).u); }
int field_Ts(Call& call) { return call.push(data_of(call).Ts); }
int field_N(Call& call) { return call.push(static_cast<long>(data_of(call).samples())); }
int field_missing(Call& call) { return call.push(static_cast<long>(sysid::missing(data_of(call)))); }
int field_experiments(Call& call) { return call.push(static_cast<long>(data_of(call).experiments())); }
int field_y_names(Call& call) { return push_words(call.L, data_of(call).y_names); }
int field_u_names(Call& call) { return push_words(call.L, data_of(call).u_names); }
int field_t(Call& call) {
  const IdData& d = data_of(call);
  return push_matrix(call.L,
                     Mat(Vec::LinSpaced(d.samples(), 0, static_cast<double>(d.samples() - 1)) * d.Ts));
}
int field_offsets(Call& call) {
  lua_createtable(call.L, 0, 2);
  push_value(call.L, Mat(data_of(call).y_offset));
  lua_setfield(call.L, -2, "y");
  push_value(call.L, Mat(data_of(call).u_offset));
  lua_setfield(call.L, -2, "u");
  return 1;
}
int to_text(Call& call) { return call.push(sysid::describe(data_of(call))); }

const OptionTable iddata_options = {
    {"y", "list or matrix", "", "the outputs: a list, a list of rows or columns, or a matrix"},
    {"u", "list or matrix", "", "the inputs, in the same way"},
    {"Ts", "number", "1", "the sampling time, in s"},
    {"yname", "string or list", "\"y\"", "the names of the outputs"},
    {"uname", "string or list", "\"u\"", "the names of the inputs"},
    {"y_names", "string or list", "", "the same as yname"},
    {"u_names", "string or list", "", "the same as uname"},
};
int feedback(Call& call) {
  const IdData& d = call.object<IdData>(1, "d");
  const long output = call.integer(2, "output", 1);
  if (output < 1 || output > d.outputs())
    throw Error(text("there is no output ", output, "; there are ", d.outputs()));
  const std::string seen = sysid::feedback_in(d, output - 1);
  if (!seen.empty()) return call.push(seen);
  return call.push_nil();
}

const OptionTable read_options = {
    {"y", "string, number or list", "", "the columns of the outputs, by name or number"},
    {"u", "string, number or list", "", "the columns of the inputs"},
    {"Ts", "number", "", "the sampling time, in s; without it that of a column t"},
};
const OptionTable detrend_options = {
    {"1", "string", "\"mean\"", "the part to remove", "mean|linear"},
    {"y", "number or list", "", "offsets of the outputs"},
    {"u", "number or list", "", "offsets of the inputs"},
};
const OptionTable resample_options = {
    {"Ts", "number", "", "the new sampling time, in s"},
    {"method", "string", "\"lowpass\"", "how values between samples are found", "lowpass|linear|hold"},
};
const OptionTable select_options = {
    {"y", "string, number or list", "", "the outputs that stay"},
    {"u", "string, number or list", "", "the inputs that stay"},
};

}  // namespace

extern const Module iddata_module = {
    "identification",
    "Identification",
    {
        {"iddata", make, "iddata{ y =, u =, Ts = 1, yname =, uname = } -> iddata",
         R"(Measured data: outputs y and inputs u, each a list, a list of rows or columns, or a matrix,
            sampled every Ts seconds. A missing sample is nan (0/0). Samples count from 1.)",
         "iddata{ y = {0, 1, 0.6}, u = {1, 0, -1}, Ts = 0.1 }",
         R"(
            data: 3 samples, Ts = 0.1, 1 output, 1 input
                         min  max      mean
              output  y    0    1  0.533333
              input   u   -1    1         0)",
         &iddata_options},
        {"iddata.read", read, "iddata.read(file [, { y =, u =, Ts = }]) -> iddata",
         R"(Reads columns of a text file (commas, semicolons, tabs or blanks; with or without a header;
            empty fields, NaN, NA: missing) or of a MATLAB .mat file. y and u name columns, or number them;
            without them those that begin with y and u are taken. Ts comes from a column t if it is not
            given.)",
         R"(
            name = os.tmpname()  f = io.open(name, "w")  f:write "t;u;y\n0;1;0,5\n2;0;\n"  f:close()
            d = iddata.read(name)  os.remove(name)
            d.Ts, d.missing)",
         "2.0 1", &read_options},
        {"iddata:slice", slice, "d:slice(first, last) -> iddata",
         "Samples first to last, counted from 1, both included.",
         "iddata{ y = {5, 6, 7, 8} }:slice(2, 3).y[1]", "6.0"},
        {"iddata:split", split, "d:split(fraction) -> iddata, iddata",
         "The first part of the samples for estimation, the rest for validation.",
         R"(
            e, v = iddata{ y = {1, 2, 3, 4} }:split(0.5)
            #e, #v)",
         "2 2"},
        {"iddata:detrend", detrend, R"(d:detrend(["mean" | "linear" | { y =, u = }]) -> iddata)",
         "Removes the means, the least-squares lines, or the given offsets of all signals.",
         "iddata{ y = {1, 2, 3} }:detrend().y[1]", "-1.0", &detrend_options},
        {"iddata:resample", resample,
         R"(d:resample(Ts [, { method = "lowpass" | "linear" | "hold" }]) -> iddata)",
         "The data on a new sampling time; lowpass keeps frequencies above the new Nyquist frequency out.",
         R"(#iddata{ y = {1, 2, 3, 4}, Ts = 1 }:resample(0.5, { method = "linear" }))", "7",
         &resample_options},
        {"merge", merge, "merge(d1, d2, …) -> iddata",
         "Several experiments as one data set: no row of a regressor reaches from one into the next.",
         "merge(iddata{ y = {1, 2} }, iddata{ y = {3} }).experiments", "2"},
        {"iddata:merge", merge, "d:merge(d2, …) -> iddata", "The same as merge(d, d2, …).", R"(
             a, b = iddata{ y = {1, 2, 3} }, iddata{ y = {4, 5} }
             a:merge(b).experiments)",
         "2"},
        {"iddata:fill", fill, R"(d:fill(["linear" | "previous"]) -> iddata)",
         "Replaces missing samples by interpolation or by the last one before.",
         "iddata{ y = {1, 0/0, 3} }:fill().y[2]", "2.0"},
        {"iddata:select", select, "d:select{ y =, u = } -> iddata",
         "Some of the signals, by name or number; a list that is not given keeps all, {} leaves all out.",
         "iddata{ y = {{1, 2}, {3, 4}, {5, 6}}, u = {1, 0, 1} }:select{ y = 2 }.y.T", "2  4  6",
         &select_options},
        {"write_mat", write_matrices, "write_mat(file, { { name, matrix }, … })",
         R"(Writes numbers, lists and matrices under these names to a MATLAB file; save "run.mat" finds names
            for the variables of a solution.)",
         R"(
            name = os.tmpname() .. ".mat"  write_mat(name, { { "x", { 1, 2, 3 } } })
            return #iddata.read(name, { y = "x", Ts = 1 }).y)",
         "3"},
        {"read_mat", read_matrices, "read_mat(file) -> { name = matrix }",
         "The matrices and numbers in a MATLAB file by name; the same as load \"run.mat\".", R"(
            name = os.tmpname() .. ".mat"  write_mat(name, { { "x", { 1, 2, 3 } } })
            return read_mat(name).x.T)",
         "1  2  3"},
        {"iddata:feedback", feedback, "d:feedback([output = 1]) -> string or nil",
         R"(Whether the data may have been taken in closed loop: χ² of the correlations of residuals of a long ARX
            model with the innovations of inputs 1 to 25 samples later, where chance explains it in less than 0.1 % of the
            cases. nil: no sign of feedback, or data that cannot say: fewer than 100 (1 + inputs) samples, gaps, inputs
            that are predictable, as sines are.)",
         "seed(4)\nu, y, e = {}, {}, randn(500)\nfor t = 1, 500 do\n  u[t] = -0.5*(y[t-1] or 0) + 0.3*(-1)^(t*t//7)\n"
         "  y[t] = 0.8*(y[t-1] or 0) + (u[t-1] or 0) + 0.5*e[t]\nend\n"
         "return iddata{ y = y, u = u }:feedback() ~= nil, iddata{ y = y, u = e }:feedback()",
         "true nil"},
        {"iddata:csv", csv, "d:csv(file)",
         R"(Writes a text table: t, the inputs, the outputs; a missing sample is an empty field.
            iddata.read reads it back.)",
         R"(
            name = os.tmpname()  iddata{ y = {1, 0/0}, u = {3, 4}, Ts = 0.5 }:csv(name)
            f = io.open(name)  print(f:read "a")  f:close()  os.remove(name))",
         "t,u,y\n0,3,1\n0.5,4,\n"},
        {"iddata:save", save, "d:save(file)",
         "As a MATLAB file (y, u, Ts) if the name ends in .mat, else as d:csv.", R"(
             d = iddata{ y = {0, 2, 1, 4, 2, 3}, u = {1, 0.5, 2, 1, 0, 1}, Ts = 1 }
             name = os.tmpname() .. ".mat"
             d:save(name)
             iddata.read(name).N)",
         "6"},
        {"iddata#y", field_y, "d.y -> matrix", "The outputs, one column each.", "", ""},
        {"iddata#u", field_u, "d.u -> matrix", "The inputs, one column each.", "", ""},
        {"iddata#t", field_t, "d.t -> column", "The sampling times, from 0.", "", ""},
        {"iddata#Ts", field_Ts, "d.Ts -> number", "The sampling time.", "", ""},
        {"iddata#N", field_N, "d.N -> integer", "The number of samples, also #d.", "", ""},
        {"iddata#missing", field_missing, "d.missing -> integer", "The number of missing values.", "", ""},
        {"iddata#experiments", field_experiments, "d.experiments -> integer",
         "The number of merged experiments.", "", ""},
        {"iddata#y_names", field_y_names, "d.y_names -> list", "The names of the outputs.", "", ""},
        {"iddata#u_names", field_u_names, "d.u_names -> list", "The names of the inputs.", "", ""},
        {"iddata#offsets", field_offsets, "d.offsets -> { y =, u = }",
         "The means or lines that detrend has removed.", "", ""},
        {"iddata:__len", field_N, "#d", "The number of samples.", "", ""},
        {"iddata:__tostring", to_text, "print(d)",
         "Sizes, ranges, means, missing values and removed offsets.", "", ""},
    }};

}  // namespace pendula::lua

// MATLAB files, by libmatio.
#include <cstring>
#include <filesystem>
#include <memory>

#include "base/error.hpp"
#include "base/text.hpp"
#include "sysid/data/iddata.hpp"

#ifdef PENDULA_MATIO
#include <dlfcn.h>
#include <matio.h>
#endif

namespace pendula::sysid {

#ifdef PENDULA_MATIO
namespace {

/// libmatio is opened when a MATLAB file is: it brings some thirty libraries with it (HDF5, curl, …), and
/// linking them takes longer than everything else at the start of the program.
struct Library {
  void* handle = dlopen(PENDULA_MATIO, RTLD_NOW | RTLD_LOCAL);
  template <class F>
  F* function(F*, const char* name) const {
    void* address = handle ? dlsym(handle, name) : nullptr;
    if (!address)
      throw Error(text("MATLAB files need the library ", PENDULA_MATIO,
                       ", which is not there (Debian: apt-get install libmatio11); or save the data as CSV"));
    return reinterpret_cast<F*>(address);
  }
};
const Library& library() {
  static const Library library;
  return library;
}
#define MATIO(name) library().function(static_cast<decltype(&name)>(nullptr), #name)

using File = std::unique_ptr<mat_t, int (*)(mat_t*)>;
using Variable = std::unique_ptr<matvar_t, void (*)(matvar_t*)>;

template <class T>
std::vector<double> converted(const void* data, std::size_t n) {
  const T* const values = static_cast<const T*>(data);
  return {values, values + n};
}

/// The entries of a real numeric array as doubles; empty for everything else.
std::vector<double> numbers(const matvar_t& v) {
  if (v.isComplex || !v.data || v.rank != 2) return {};
  const std::size_t n = v.dims[0] * v.dims[1];
  switch (v.data_type) {
    case MAT_T_DOUBLE:
      return converted<double>(v.data, n);
    case MAT_T_SINGLE:
      return converted<float>(v.data, n);
    case MAT_T_INT8:
      return converted<std::int8_t>(v.data, n);
    case MAT_T_UINT8:
      return converted<std::uint8_t>(v.data, n);
    case MAT_T_INT16:
      return converted<std::int16_t>(v.data, n);
    case MAT_T_UINT16:
      return converted<std::uint16_t>(v.data, n);
    case MAT_T_INT32:
      return converted<std::int32_t>(v.data, n);
    case MAT_T_UINT32:
      return converted<std::uint32_t>(v.data, n);
    case MAT_T_INT64:
      return converted<std::int64_t>(v.data, n);
    case MAT_T_UINT64:
      return converted<std::uint64_t>(v.data, n);
    default:
      return {};
  }
}

/// Vectors are columns; a matrix gives name1, name2, …; the fields of a structure count as variables.
void collect(const matvar_t& v, const std::string& name, FileColumns& table) {
  if (v.class_type == MAT_C_STRUCT) {
    if (v.rank != 2 || v.dims[0] != 1 || v.dims[1] != 1) return;
    auto* const structure = const_cast<matvar_t*>(&v);
    const char* const* const fields = MATIO(Mat_VarGetStructFieldnames)(structure);
    for (unsigned i = 0, n = MATIO(Mat_VarGetNumberOfFields)(structure); i < n; ++i)
      if (const matvar_t* field = MATIO(Mat_VarGetStructFieldByIndex)(structure, i, 0))
        collect(*field, fields[i], table);
    return;
  }
  if (v.class_type == MAT_C_CHAR) return;
  const std::vector<double> all = numbers(v);
  if (all.empty()) return;
  std::size_t rows = v.dims[0], cols = v.dims[1];
  if (rows == 1) std::swap(rows, cols);
  for (std::size_t j = 0; j < cols; ++j) {
    table.names.push_back(cols == 1 ? name : name + std::to_string(j + 1));
    table.columns.emplace_back(all.begin() + static_cast<std::ptrdiff_t>(j * rows),
                               all.begin() + static_cast<std::ptrdiff_t>((j + 1) * rows));
  }
}

void write(mat_t* file, const char* name, const Mat& m, const std::string& path) {
  std::size_t dims[2] = {static_cast<std::size_t>(m.rows()), static_cast<std::size_t>(m.cols())};
  const Variable v(
      MATIO(Mat_VarCreate)(name, MAT_C_DOUBLE, MAT_T_DOUBLE, 2, dims, const_cast<double*>(m.data()), 0),
      MATIO(Mat_VarFree));
  if (!v || MATIO(Mat_VarWrite)(file, v.get(), MAT_COMPRESSION_NONE) != 0)
    throw Error(text("cannot write ", path));
}

}  // namespace

FileColumns read_mat(const std::string& path) {
  if (!std::filesystem::is_regular_file(path))
    throw Error(text("cannot open ", path, " as a MATLAB file: there is no such file"));
  const File file(MATIO(Mat_Open)(path.c_str(), MAT_ACC_RDONLY), MATIO(Mat_Close));
  if (!file) throw Error(text("cannot open ", path, " as a MATLAB file"));
  FileColumns table;
  while (matvar_t* raw = MATIO(Mat_VarReadNext)(file.get())) {
    const Variable variable(raw, MATIO(Mat_VarFree));
    collect(*raw, raw->name, table);
  }
  if (table.names.empty()) throw Error(text(path, " holds no real matrix of numbers"));
  return table;
}

void write_mat(const IdData& d, const std::string& path) {
  const File file(MATIO(Mat_CreateVer)(path.c_str(), nullptr, MAT_FT_MAT5), MATIO(Mat_Close));
  if (!file) throw Error(text("cannot write ", path));
  write(file.get(), "y", d.y, path);
  if (d.inputs() > 0) write(file.get(), "u", d.u, path);
  write(file.get(), "Ts", Mat::Constant(1, 1, d.Ts), path);
  if (d.experiments() == 1) return;
  Mat starts(d.experiments(), 1);
  for (Index k = 0; k < d.experiments(); ++k) starts(k, 0) = static_cast<double>(d.starts[k] + 1);
  write(file.get(), "starts", starts, path);
}
#else
FileColumns read_mat(const std::string& path) {
  throw Error(text("cannot read ", path, ": this program was built without libmatio; save the data as CSV"));
}
void write_mat(const IdData&, const std::string& path) {
  throw Error(text("cannot write ", path, ": this program was built without libmatio; save the data as CSV"));
}
#endif

}  // namespace pendula::sysid

// MATLAB files, read and written by libmatio.
#include "sysid/data/iddata.hpp"

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <new>
#include <sstream>

#include "base/error.hpp"
#include "base/files/draft.hpp"
#include "base/stoppable.hpp"
#include "base/text.hpp"
#include "sysid/data/mat_memory.hpp"

#ifdef PENDULA_MATIO
#include <dlfcn.h>
#include <matio.h>
#include <sys/mman.h>
#include <unistd.h>
#endif

namespace pendula::sysid {

#ifdef PENDULA_MATIO
namespace {

/// libmatio, loaded on first use: it depends on some thirty libraries (HDF5, curl, …), and linking them takes
/// longer than the rest of the program's start.
struct Library {
  void* handle = dlopen(PENDULA_MATIO, RTLD_NOW | RTLD_LOCAL);
  template <class F>
  F* function(F*, const char* name) const {
    void* address = handle ? dlsym(handle, name) : nullptr;
    if (!address)
      throw Error(
          text("MATLAB files need the library ", PENDULA_MATIO,
               ", which is not installed (Debian: apt-get install libmatio11); or save the data as CSV"));
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

/// A file in memory with a name.
class MemoryFile {
 public:
  MemoryFile() : descriptor_(memfd_create("pendula-mat", MFD_CLOEXEC)) {
    if (descriptor_ < 0) throw Error("no memory for a MATLAB file");
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile() { close(descriptor_); }
  std::string path() const { return text("/proc/self/fd/", descriptor_); }
  std::string content() const {
    std::ostringstream out;
    out << std::ifstream(path(), std::ios::binary).rdbuf();
    return out.str();
  }

 private:
  int descriptor_;
};

/// n entries of this type as doubles; empty if the type is not numeric. `bytes`: the available size.
std::vector<double> entries_as(matio_types type, const void* data, std::size_t n, std::size_t bytes) {
  const auto as = [&]<class T>(T) -> std::vector<double> {
    if (n > bytes / sizeof(T)) throw Error("an array is shorter than its size says: the file is damaged");
    const T* const values = static_cast<const T*>(data);
    return {values, values + n};
  };
  switch (type) {
    case MAT_T_DOUBLE:
      return as(double{});
    case MAT_T_SINGLE:
      return as(float{});
    case MAT_T_INT8:
      return as(std::int8_t{});
    case MAT_T_UINT8:
      return as(std::uint8_t{});
    case MAT_T_INT16:
      return as(std::int16_t{});
    case MAT_T_UINT16:
      return as(std::uint16_t{});
    case MAT_T_INT32:
      return as(std::int32_t{});
    case MAT_T_UINT32:
      return as(std::uint32_t{});
    case MAT_T_INT64:
      return as(std::int64_t{});
    case MAT_T_UINT64:
      return as(std::uint64_t{});
    default:
      return {};
  }
}

struct Shape {
  std::size_t rows = 0, cols = 0;
  std::size_t size() const { return rows * cols; }
};

/// The shape of a two-dimensional array; empty for everything else.
Shape shape_of(const matvar_t& v) {
  constexpr std::size_t most = std::size_t{1} << 32;  // 32 GB of doubles; rows·cols cannot overflow below it
  if (v.rank != 2 || !v.dims) return {};
  const Shape shape{v.dims[0], v.dims[1]};
  if (shape.cols > 0 && shape.rows > most / shape.cols)
    throw Error(text("an array of ", shape.rows, "×", shape.cols, " entries: the file is damaged"));
  return shape;
}

constexpr std::size_t most_full_entries = 10'000'000;  // of a sparse matrix that is made full: 80 MB

/// Converts compressed columns (jc: where each begins, ir: the rows of its entries) to a full array. All
/// values from the file are validated.
std::vector<double> from_sparse(const matvar_t& v, Shape shape) {
  if (shape.size() > most_full_entries)
    throw Error(text("a sparse ", shape.rows, "×", shape.cols, " matrix is too large to be data"));
  const auto& sparse = *static_cast<const mat_sparse_t*>(v.data);
  const auto damaged = [] { return Error("the indices of a sparse matrix are damaged"); };
  if (!sparse.jc || sparse.njc != shape.cols + 1) throw damaged();
  if (sparse.ndata == 0 && sparse.jc[shape.cols] == 0) return std::vector<double>(shape.size());
  if (!sparse.ir || !sparse.data || sparse.ndata == 0) throw damaged();
  const std::size_t bytes = static_cast<std::size_t>(sparse.ndata) * MATIO(Mat_SizeOf)(v.data_type);
  const std::vector<double> values = entries_as(v.data_type, sparse.data, sparse.ndata, bytes);
  if (values.empty()) return {};
  std::vector<double> full(shape.size());
  for (std::size_t j = 0; j < shape.cols; ++j) {
    const std::size_t first = sparse.jc[j], last = sparse.jc[j + 1];
    if (first > last || last > sparse.nir || last > values.size()) throw damaged();
    for (std::size_t k = first; k < last; ++k) {
      if (sparse.ir[k] >= shape.rows) throw damaged();
      full[j * shape.rows + sparse.ir[k]] = values[k];
    }
  }
  return full;
}

/// The entries of a real numeric array as doubles, column by column; empty for everything else.
std::vector<double> numbers(const matvar_t& v) {
  const Shape shape = shape_of(v);
  if (v.isComplex || !v.data || shape.size() == 0) return {};
  switch (v.class_type) {
    case MAT_C_DOUBLE:
    case MAT_C_SINGLE:
    case MAT_C_INT8:
    case MAT_C_UINT8:
    case MAT_C_INT16:
    case MAT_C_UINT16:
    case MAT_C_INT32:
    case MAT_C_UINT32:
    case MAT_C_INT64:
    case MAT_C_UINT64:
      return entries_as(v.data_type, v.data, shape.size(), v.nbytes);
    case MAT_C_SPARSE:
      return from_sparse(v, shape);
    default:
      return {};
  }
}

void collect(const matvar_t& v, const std::string& name, NamedMatrices& found, int depth);

void collect_fields(const matvar_t& v, NamedMatrices& found, int depth) {
  constexpr int deepest = 32;  // bounds the stack; files of data have two or three levels
  if (depth >= deepest)
    throw Error(text("structures nested more than ", deepest, " deep: save the signals as plain matrices"));
  if (!v.data || shape_of(v).size() != 1) return;
  auto* const structure = const_cast<matvar_t*>(&v);
  const char* const* const names = MATIO(Mat_VarGetStructFieldnames)(structure);
  if (!names) return;
  for (unsigned i = 0, n = MATIO(Mat_VarGetNumberOfFields)(structure); i < n; ++i) {
    const matvar_t* const field = MATIO(Mat_VarGetStructFieldByIndex)(structure, i, 0);
    if (field && names[i]) collect(*field, names[i], found, depth + 1);
  }
}

/// Collects arrays; fields of a structure become variables of their own.
void collect(const matvar_t& v, const std::string& name, NamedMatrices& found, int depth) {
  if (v.class_type == MAT_C_STRUCT) return collect_fields(v, found, depth);
  const Shape shape = shape_of(v);
  const std::vector<double> all = numbers(v);
  if (all.empty()) return;
  found.emplace_back(name, Eigen::Map<const Mat>(all.data(), static_cast<Eigen::Index>(shape.rows),
                                                 static_cast<Eigen::Index>(shape.cols)));
}

/// The columns of all variables; a matrix gives name1, name2, …
FileColumns columns_of(const NamedMatrices& variables) {
  constexpr Eigen::Index most_columns = 10'000;  // each gets a name; a matrix with more is an image
  FileColumns table;
  for (const auto& [name, matrix] : variables) {
    const Mat m = matrix.rows() == 1 ? Mat(matrix.transpose()) : matrix;
    if (m.cols() > most_columns)
      throw Error(
          text("'", name, "' is a matrix of ", m.cols(), " columns; data have at most ", most_columns));
    for (Eigen::Index j = 0; j < m.cols(); ++j) {
      table.names.push_back(m.cols() == 1 ? name : name + std::to_string(j + 1));
      table.columns.emplace_back(m.col(j).begin(), m.col(j).end());
    }
  }
  return table;
}

void write(mat_t* file, const char* name, const Mat& m, const std::string& path) {
  std::size_t dims[2] = {static_cast<std::size_t>(m.rows()), static_cast<std::size_t>(m.cols())};
  const Variable v(
      MATIO(Mat_VarCreate)(name, MAT_C_DOUBLE, MAT_T_DOUBLE, 2, dims, const_cast<double*>(m.data()), 0),
      MATIO(Mat_VarFree));
  if (!v || MATIO(Mat_VarWrite)(file, v.get(), MAT_COMPRESSION_NONE) != 0)
    throw Error(text("cannot write ", path));
}

/// The file contents written by libmatio to memory, since it does not report a full disk.
std::string written(const NamedMatrices& variables, const std::string& path) {
  const MemoryFile memory;
  {
    const File file(MATIO(Mat_CreateVer)(memory.path().c_str(), nullptr, MAT_FT_MAT5), MATIO(Mat_Close));
    if (!file) throw Error(text("cannot write ", path));
    for (const auto& [name, matrix] : variables) write(file.get(), name.c_str(), matrix, path);
  }
  return memory.content();
}

/// The number of variables. Rejects full arrays with more entries than the file has bytes.
int counted(mat_t* file, std::uintmax_t bytes) {
  int count = 0;
  for (; matvar_t* raw = MATIO(Mat_VarReadNextInfo)(file); ++count) {
    const Variable variable(raw, MATIO(Mat_VarFree));
    if (raw->class_type == MAT_C_SPARSE || raw->class_type == MAT_C_STRUCT || !raw->dims) continue;
    std::uintmax_t entries = 1;
    for (int k = 0; k < raw->rank; ++k)
      if (raw->dims[k] > 0 && (entries *= raw->dims[k]) > bytes)
        throw Error("an array is larger than the file: it is damaged");
  }
  MATIO(Mat_Rewind)(file);
  return count;
}

NamedMatrices read_here(const std::string& path, std::uintmax_t bytes) {
  // int8 become doubles, twice, and libmatio keeps as much again; its buffers come in addition
  constexpr std::uintmax_t copies = 32,
                           buffers = (std::uintmax_t{64} << 20) + 2 * sizeof(double) * most_full_entries;
  const MemoryLimit limit(copies * bytes + buffers);
  const File file(MATIO(Mat_Open)(path.c_str(), MAT_ACC_RDONLY), MATIO(Mat_Close));
  if (!file) throw Error("it cannot be opened as a MATLAB file");
  NamedMatrices found;
  int left = counted(file.get(), bytes);
  for (; matvar_t* raw = MATIO(Mat_VarReadNext)(file.get()); --left) {
    const Variable variable(raw, MATIO(Mat_VarFree));
    if (raw->name) collect(*raw, raw->name, found, 0);
  }
  if (left > 0) throw Error("not all of its variables can be read: it is damaged");
  return found;
}

/// Reads a file in a process of its own, which can be limited, interrupted, and may crash. Names are
/// transferred as matrices of bytes.
NamedMatrices read_in_child(const std::string& path, std::uintmax_t bytes) {
  constexpr double always = INFINITY;
  const std::vector<Mat> parts = stoppable(always, [&] {
    std::vector<Mat> sent;
    for (auto& [name, matrix] : read_here(path, bytes)) {
      sent.push_back(Eigen::Map<const Eigen::Matrix<char, 1, Eigen::Dynamic>>(
                         name.data(), static_cast<Eigen::Index>(name.size()))
                         .cast<double>());
      sent.push_back(std::move(matrix));
    }
    return sent;
  });
  NamedMatrices found;
  for (std::size_t k = 0; k + 1 < parts.size(); k += 2)
    found.emplace_back(std::string(parts[k].data(), parts[k].data() + parts[k].size()), parts[k + 1]);
  return found;
}

}  // namespace

NamedMatrices read_matrices(const std::string& path) {
  if (!std::filesystem::is_regular_file(path))
    throw Error(
        text("cannot open ", path, " as a MATLAB file: ",
             std::filesystem::exists(path) ? "it is a folder, a pipe or a device" : "there is no such file"));
  library();  // loaded once, before the child exists
  NamedMatrices found;
  try {
    found = read_in_child(path, unpacked_size(path));
  } catch (const Error& e) {
    throw Error(text(path, ": ", e.what()));
  } catch (const ChildEnded&) {
    throw Error(text(path, ": libmatio crashes while reading it: the file is damaged"));
  } catch (const Failure& e) {
    throw Failure(text(path, ": ", e.what()));
  } catch (const std::bad_alloc&) {
    throw Error(
        text(path, " claims more data than fit into memory: it is damaged or too large for this machine"));
  }
  if (found.empty()) throw Error(text(path, " holds no real matrix of numbers"));
  return found;
}

FileColumns read_mat(const std::string& path) {
  const NamedMatrices found = read_matrices(path);
  try {
    return columns_of(found);
  } catch (const Error& e) {
    throw Error(text(path, ": ", e.what()));
  }
}

void write_mat(const NamedMatrices& variables, const std::string& path) {
  write_file(path, written(variables, path));
}
#else
NamedMatrices read_matrices(const std::string& path) {
  throw Error(text("cannot read ", path, ": this program was built without libmatio; save the data as CSV"));
}
FileColumns read_mat(const std::string& path) { return (read_matrices(path), FileColumns{}); }
void write_mat(const NamedMatrices&, const std::string& path) {
  throw Error(text("cannot write ", path, ": this program was built without libmatio; save the data as CSV"));
}
#endif

void write_mat(const IdData& d, const std::string& path) {
  NamedMatrices variables{{"y", d.y}};
  if (d.inputs() > 0) variables.emplace_back("u", d.u);
  variables.emplace_back("Ts", Mat::Constant(1, 1, d.Ts));
  if (d.experiments() > 1) {
    Mat starts(d.experiments(), 1);
    for (Eigen::Index k = 0; k < d.experiments(); ++k) starts(k, 0) = static_cast<double>(d.starts[k] + 1);
    variables.emplace_back("starts", starts);
  }
  write_mat(variables, path);
}

}  // namespace pendula::sysid

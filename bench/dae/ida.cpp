#include "ida.hpp"

#include "base/error.hpp"

#include <ida/ida.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunlinsol/sunlinsol_klu.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunmatrix/sunmatrix_sparse.h>
#include <xmmintrin.h>

#include <ctime>
#include <map>

namespace pendula::bench {
namespace {

/// What the callbacks need: y = (x, z), y′ = (x′, ·).
struct Data {
  integrate::Problem& problem;
  bool sparse;
  // Compressed columns of ∂F/∂y + c ∂F/∂y′ and, for every entry of the problem's Jacobian, where it goes.
  std::vector<sunindextype> column_start, row;
  std::vector<std::size_t> target;
  std::vector<bool> derivative;
};

int column_of(const integrate::Problem& p, int column) { return column < p.n() ? column : column - p.n(); }

void place(Data& d, double t, N_Vector y, N_Vector yp) {
  const double *a = N_VGetArrayPointer(y), *b = N_VGetArrayPointer(yp);
  d.problem.set_point(t, a, b, a + d.problem.n());
}

int residual(double t, N_Vector y, N_Vector yp, N_Vector r, void* user) {
  Data& d = *static_cast<Data*>(user);
  place(d, t, y, yp);
  double* out = N_VGetArrayPointer(r);
  d.problem.residual(out);
  double sum = 0;
  for (int i = 0; i < d.problem.n() + d.problem.m(); ++i) sum += out[i] * 0;
  return sum == 0 ? 0 : 1;  // not finite: recoverable
}

int jacobian(double t, double c, N_Vector y, N_Vector yp, N_Vector, SUNMatrix J, void* user, N_Vector,
             N_Vector, N_Vector) {
  Data& d = *static_cast<Data*>(user);
  place(d, t, y, yp);
  const std::vector<double>& values = d.problem.jacobian();
  const auto& pattern = d.problem.pattern();
  if (d.sparse) {
    SUNMatZero(J);
    std::copy(d.column_start.begin(), d.column_start.end(), SUNSparseMatrix_IndexPointers(J));
    std::copy(d.row.begin(), d.row.end(), SUNSparseMatrix_IndexValues(J));
    double* to = SUNSparseMatrix_Data(J);
    for (std::size_t k = 0; k < values.size(); ++k)
      to[d.target[k]] += d.derivative[k] ? c * values[k] : values[k];
    return 0;
  }
  for (std::size_t k = 0; k < values.size(); ++k)
    SM_ELEMENT_D(J, pattern[k].row, column_of(d.problem, pattern[k].column)) +=
        d.derivative[k] ? c * values[k] : values[k];
  return 0;
}

Data prepare(integrate::Problem& problem, bool sparse) {
  Data d{problem, sparse, {}, {}, {}, {}};
  const int n = problem.n(), N = n + problem.m();
  std::map<std::pair<int, int>, std::size_t> places;  // by column, then row
  for (const auto& e : problem.pattern()) places[{column_of(problem, e.column), e.row}] = 0;
  d.column_start.assign(static_cast<std::size_t>(N) + 1, 0);
  for (auto& [where, place] : places) {
    place = d.row.size();
    d.row.push_back(where.second);
    ++d.column_start[static_cast<std::size_t>(where.first) + 1];
  }
  for (std::size_t k = 1; k < d.column_start.size(); ++k) d.column_start[k] += d.column_start[k - 1];
  for (const auto& e : problem.pattern()) {
    d.target.push_back(places[{column_of(problem, e.column), e.row}]);
    d.derivative.push_back(e.column >= n && e.column < 2 * n);
  }
  return d;
}

N_Vector vector_of(const Vec& head, const Vec& tail, SUNContext context) {
  N_Vector v = N_VNew_Serial(head.size() + tail.size(), context);
  std::copy(head.begin(), head.end(), N_VGetArrayPointer(v));
  std::copy(tail.begin(), tail.end(), N_VGetArrayPointer(v) + head.size());
  return v;
}

}  // namespace

IdaResult run_ida(integrate::Problem& problem, const integrate::Point& start, const IdaOptions& options) {
  Data data = prepare(problem, options.sparse);
  const int n = problem.n(), N = n + problem.m();
  SUNContext context;
  SUNContext_Create(nullptr, &context);
  N_Vector y = vector_of(start.x, start.z, context),
           yp = vector_of(start.xdot, Vec::Zero(problem.m()), context);
  N_Vector id = vector_of(Vec::Ones(n), Vec::Zero(problem.m()), context);
  void* ida = IDACreate(context);
  IDAInit(ida, residual, start.t, y, yp);
  IDASStolerances(ida, options.rtol, options.atol);
  IDASetUserData(ida, &data);
  IDASetId(ida, id);
  IDASetSuppressAlg(ida, options.suppress_algebraic && problem.m() > 0);
  IDASetMaxNumSteps(ida, 10'000'000);
  IDASetStopTime(ida, options.to);
  IDASetErrHandlerFn(
      ida, [](int, const char*, const char*, char*, void*) {}, nullptr);
  if (options.newton_coefficient > 0) IDASetNonlinConvCoef(ida, options.newton_coefficient);
  SUNMatrix J = options.sparse
                    ? SUNSparseMatrix(N, N, static_cast<sunindextype>(data.row.size()), CSC_MAT, context)
                    : SUNDenseMatrix(N, N, context);
  SUNLinearSolver solver = options.sparse ? SUNLinSol_KLU(y, J, context) : SUNLinSol_Dense(y, J, context);
  IDASetLinearSolver(ida, solver, J);
  IDASetJacFn(ida, jacobian);

  const unsigned mode = _mm_getcsr();
  if (options.flush_denormals) _mm_setcsr(mode | 0x8040);
  const std::clock_t before = std::clock();  // processor time, as ours
  double reached = start.t;
  const int status = IDASolve(ida, options.to, &reached, y, yp, IDA_NORMAL);
  IdaResult result;
  result.seconds = static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC;
  _mm_setcsr(mode);
  if (status < 0)
    result.trouble = text("IDA gave up (", status, ") at t = ", reached);
  else
    result.y = Eigen::Map<const Vec>(N_VGetArrayPointer(y), N);
  IDAGetNumSteps(ida, &result.steps);
  IDAGetNumResEvals(ida, &result.residuals);
  IDAGetNumJacEvals(ida, &result.jacobians);
  IDAFree(&ida);
  SUNLinSolFree(solver);
  SUNMatDestroy(J);
  for (N_Vector v : {y, yp, id}) N_VDestroy(v);
  SUNContext_Free(&context);
  return result;
}

}  // namespace pendula::bench

#include "cvode.hpp"

#include <arkode/arkode_erkstep.h>
#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <ctime>
#include <functional>

#include "base/error.hpp"

namespace pendula::bench {
namespace {

void silent(int, const char*, const char*, char*, void*) {}

int slope(double t, N_Vector y, N_Vector f, void* user) {
  auto& problem = *static_cast<integrate::Problem*>(user);
  problem.set_time(t);
  std::copy_n(N_VGetArrayPointer(y), problem.n(), problem.unknowns());
  problem.rhs(N_VGetArrayPointer(f));
  double sum = 0;
  for (int i = 0; i < problem.n(); ++i) sum += N_VGetArrayPointer(f)[i] * 0;
  return sum == 0 ? 0 : 1;  // not finite: recoverable
}

IdaResult timed(const std::function<int(double*)>& solve, N_Vector y, int n) {
  const std::clock_t before = std::clock();
  double reached = 0;
  const int status = solve(&reached);
  IdaResult result;
  result.seconds = static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC;
  if (status < 0)
    result.trouble = text("gave up (", status, ") at t = ", reached);
  else
    result.y = Eigen::Map<const Vec>(N_VGetArrayPointer(y), n);
  return result;
}

IdaResult run_cvode(integrate::Problem& problem, double from, N_Vector y, bool bdf, const IdaOptions& o,
                    SUNContext context) {
  void* cvode = CVodeCreate(bdf ? CV_BDF : CV_ADAMS, context);
  CVodeInit(cvode, slope, from, y);
  CVodeSStolerances(cvode, o.rtol, o.atol);
  CVodeSetUserData(cvode, &problem);
  CVodeSetMaxNumSteps(cvode, 1'000'000);
  CVodeSetStopTime(cvode, o.to);
  CVodeSetErrHandlerFn(cvode, silent, nullptr);
  SUNMatrix J = nullptr;
  SUNLinearSolver linear = nullptr;
  SUNNonlinearSolver iteration = nullptr;
  if (bdf) {
    J = SUNDenseMatrix(problem.n(), problem.n(), context);
    linear = SUNLinSol_Dense(y, J, context);
    CVodeSetLinearSolver(cvode, linear, J);
  } else {
    iteration = SUNNonlinSol_FixedPoint(y, 0, context);
    CVodeSetNonlinearSolver(cvode, iteration);
  }
  const auto solve = [&](double* t) { return CVode(cvode, o.to, y, t, CV_NORMAL); };
  IdaResult result = timed(solve, y, problem.n());
  CVodeGetNumSteps(cvode, &result.steps);
  CVodeGetNumRhsEvals(cvode, &result.residuals);
  CVodeFree(&cvode);
  if (bdf) {
    SUNLinSolFree(linear);
    SUNMatDestroy(J);
  } else {
    SUNNonlinSolFree(iteration);
  }
  return result;
}

IdaResult run_erk(integrate::Problem& problem, double from, N_Vector y, const IdaOptions& o,
                  SUNContext context) {
  void* erk = ERKStepCreate(slope, from, y, context);
  ERKStepSStolerances(erk, o.rtol, o.atol);
  ERKStepSetUserData(erk, &problem);
  ERKStepSetOrder(erk, 8);
  ERKStepSetMaxNumSteps(erk, 1'000'000);
  ERKStepSetStopTime(erk, o.to);
  ERKStepSetErrHandlerFn(erk, silent, nullptr);
  const auto solve = [&](double* t) { return ERKStepEvolve(erk, o.to, y, t, ARK_NORMAL); };
  IdaResult result = timed(solve, y, problem.n());
  ERKStepGetNumSteps(erk, &result.steps);
  ERKStepGetNumRhsEvals(erk, &result.residuals);
  ERKStepFree(&erk);
  return result;
}

}  // namespace

IdaResult run_ode_peer(integrate::Problem& problem, const integrate::Point& start, OdePeer peer,
                       const IdaOptions& options) {
  if (!problem.is_ode()) throw Error("CVODE and ARKODE take x′ = f(t, x) only");
  SUNContext context;
  SUNContext_Create(nullptr, &context);
  N_Vector y = N_VNew_Serial(problem.n(), context);
  std::copy(start.x.begin(), start.x.end(), N_VGetArrayPointer(y));
  IdaResult result = peer == OdePeer::erk
                         ? run_erk(problem, start.t, y, options, context)
                         : run_cvode(problem, start.t, y, peer == OdePeer::bdf, options, context);
  N_VDestroy(y);
  SUNContext_Free(&context);
  return result;
}

}  // namespace pendula::bench

#include "lua/bind/modules.hpp"

namespace pendula::lua {

extern const Module symbols_module;
extern const Module expr_module;
extern const Module polynomial_module;
extern const Module functions_module;
extern const Module matrix_module;
extern const Module entries_module;
extern const Module calculus_module;
extern const Module algebra_module;
extern const Module factors_module;
extern const Module model_input_module;
extern const Module dae_module;
extern const Module forms_module;
extern const Module start_module;
extern const Module units_module;
extern const Module pencil_module;
extern const Module mech_module;
extern const Module structure_module;
extern const Module random_module;
extern const Module distributions_module;
extern const Module samples_module;
extern const Module tableau_module;
extern const Module methods_module;
extern const Module stability_module;
extern const Module integrate_module;
extern const Module solution_module;
extern const Module run_records_module;
extern const Module solution_parts_module;
extern const Module newton_module;
extern const Module iddata_module;
extern const Module prefilter_module;
extern const Module idmodel_module;
extern const Module idmodel_fields_module;
extern const Module idmodel_predict_module;
extern const Module idmodel_systems_module;
extern const Module lsq_module;
extern const Module likelihood_module;
extern const Module gauss_newton_module;
extern const Module validation_module;
extern const Module predictor_module;
extern const Module grey_box_module;
extern const Module search_module;
extern const Module complex_module;
extern const Module lti_construct_module;
extern const Module lti_module;
extern const Module lti_connect_module;
extern const Module lti_analysis_module;
extern const Module lti_design_module;
extern const Module lti_response_module;
extern const Module lti_delay_module;
extern const Module lti_linearize_module;
extern const Module sweep_module;
extern const Module sweep_run_module;
extern const Module sweep_design_module;
extern const Module shards_module;
extern const Module parallel_module;
extern const Module signals_module;
extern const Module plot_module;

const std::vector<const Module*>& modules() {
  static const std::vector<const Module*> list = {&symbols_module,
                                                  &expr_module,
                                                  &functions_module,
                                                  &polynomial_module,
                                                  &matrix_module,
                                                  &entries_module,
                                                  &calculus_module,
                                                  &algebra_module,
                                                  &factors_module,
                                                  &mech_module,
                                                  &model_input_module,
                                                  &dae_module,
                                                  &forms_module,
                                                  &start_module,
                                                  &units_module,
                                                  &pencil_module,
                                                  &structure_module,
                                                  &random_module,
                                                  &distributions_module,
                                                  &samples_module,
                                                  &tableau_module,
                                                  &methods_module,
                                                  &stability_module,
                                                  &integrate_module,
                                                  &solution_module,
                                                  &run_records_module,
                                                  &solution_parts_module,
                                                  &newton_module,
                                                  &gauss_newton_module,
                                                  &sweep_run_module,
                                                  &sweep_module,
                                                  &sweep_design_module,
                                                  &shards_module,
                                                  &parallel_module,
                                                  &iddata_module,
                                                  &idmodel_module,
                                                  &idmodel_predict_module,
                                                  &idmodel_fields_module,
                                                  &idmodel_systems_module,
                                                  &lsq_module,
                                                  &likelihood_module,
                                                  &validation_module,
                                                  &predictor_module,
                                                  &complex_module,
                                                  &lti_construct_module,
                                                  &lti_module,
                                                  &lti_connect_module,
                                                  &lti_analysis_module,
                                                  &lti_design_module,
                                                  &lti_response_module,
                                                  &lti_linearize_module,
                                                  &signals_module,
                                                  &grey_box_module,
                                                  &search_module,
                                                  &lti_delay_module,
                                                  &prefilter_module,
                                                  &plot_module};
  return list;
}

}  // namespace pendula::lua

# Machine code by asmjit, vector functions for four and eight lanes by SLEEF. Without them, or elsewhere than on x86-64, kernels
# run on the tape, which gives the same results.
if(PENDULA_MACHINE_CODE AND CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  find_package(asmjit CONFIG)
  if(asmjit_FOUND)
    target_compile_definitions(pendula_codegen PRIVATE PENDULA_MACHINE_CODE)
    target_link_libraries(pendula_codegen PRIVATE asmjit::asmjit)
    pkg_check_modules(SLEEF IMPORTED_TARGET sleef)
    if(SLEEF_FOUND)
      target_compile_definitions(pendula_codegen PRIVATE PENDULA_SLEEF)
      target_link_libraries(pendula_codegen PRIVATE PkgConfig::SLEEF)
      set_source_files_properties(src/codegen/machine/lane_functions_avx2.cpp src/codegen/routines/lane_product_avx2.cpp
                                  src/codegen/routines/sines_avx2.cpp
                                  PROPERTIES COMPILE_OPTIONS "-mavx2;-mfma" SKIP_PRECOMPILE_HEADERS ON)
      set_source_files_properties(src/codegen/machine/lane_functions_avx512.cpp PROPERTIES COMPILE_OPTIONS "-mavx512f;-mfma"
                                  SKIP_PRECOMPILE_HEADERS ON)
    endif()
  endif()
endif()

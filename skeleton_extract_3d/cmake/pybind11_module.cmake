# add_pybind11_module(NAME SOURCE...): a compiled Python module, built by catkin or by plain CMake.
#
# By catkin it goes where Python modules of the devel and the install space are, by plain CMake into the build folder.
# pybind11's own CMake functions are not used: they overwrite catkin's choice of Python in the cache of the workspace.
function(add_pybind11_module name)
  if(NOT PYTHON_EXECUTABLE)
    set(PYTHON_EXECUTABLE /usr/bin/python3)
  endif()
  execute_process(
    COMMAND ${PYTHON_EXECUTABLE} -c
      "from sysconfig import get_config_var, get_path; print(get_path('include'), get_config_var('EXT_SUFFIX'), sep=';')"
    OUTPUT_VARIABLE python RESULT_VARIABLE status OUTPUT_STRIP_TRAILING_WHITESPACE)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "${name}: PYTHON_EXECUTABLE = ${PYTHON_EXECUTABLE} does not work: ${status}")
  endif()
  list(GET python 0 python_include_dir)
  list(GET python 1 suffix)
  find_path(PYBIND11_INCLUDE_DIR pybind11/pybind11.h)
  if(NOT PYBIND11_INCLUDE_DIR)
    message(FATAL_ERROR "${name} needs pybind11: apt-get install pybind11-dev, or set PYBIND11_INCLUDE_DIR")
  elseif(NOT EXISTS "${python_include_dir}/Python.h")
    message(FATAL_ERROR "${name} needs ${python_include_dir}/Python.h: apt-get install python3-dev")
  endif()

  add_library(${name} MODULE ${ARGN})
  target_include_directories(${name} SYSTEM PRIVATE ${PYBIND11_INCLUDE_DIR} ${python_include_dir})
  # Optimised whatever the build type is. No contraction: results do not depend on what the processor can fuse. No
  # -ffast-math: NaN stands for what is missing.
  target_compile_options(${name} PRIVATE -O3 -ffp-contract=off -fno-math-errno -Wall -Wextra)
  set_target_properties(${name} PROPERTIES
    CXX_STANDARD 17 CXX_STANDARD_REQUIRED ON CXX_VISIBILITY_PRESET hidden
    UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 0  # one unit: the headers of pybind11 take most of the time
    PREFIX "" SUFFIX "${suffix}")
  if(CATKIN_DEVEL_PREFIX)
    set(output ${CATKIN_DEVEL_PREFIX}/${CATKIN_GLOBAL_PYTHON_DESTINATION})
    install(TARGETS ${name} LIBRARY DESTINATION ${CATKIN_GLOBAL_PYTHON_DESTINATION})
  else()
    set(output ${CMAKE_BINARY_DIR})
  endif()
  set_target_properties(${name} PROPERTIES LIBRARY_OUTPUT_DIRECTORY ${output})
endfunction()

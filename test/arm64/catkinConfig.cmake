# In place of catkin, where ROS cannot be installed for the processor that is built for: what needs no ROS configures, builds
# and is tested as ever. Targets that need ROS exist, too, but cannot be built.
set(catkin_FOUND TRUE)
set(CATKIN_ENABLE_TESTING TRUE)
set(CATKIN_PACKAGE_BIN_DESTINATION lib/${PROJECT_NAME})
set(CATKIN_PACKAGE_LIB_DESTINATION lib)
set(CATKIN_GLOBAL_BIN_DESTINATION bin)
set(CATKIN_PACKAGE_INCLUDE_DESTINATION include/${PROJECT_NAME})
set(CATKIN_PACKAGE_SHARE_DESTINATION share/${PROJECT_NAME})
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)
find_package(GTest REQUIRED)

foreach(name add_message_files add_service_files generate_messages catkin_package catkin_install_python add_rostest
    roslaunch_add_file_check)
  function(${name})
  endfunction()
endforeach()

add_custom_target(tests)
add_custom_target(messages)
set(catkin_EXPORTED_TARGETS messages)
set(${PROJECT_NAME}_EXPORTED_TARGETS messages)
foreach(name catkin_add_gtest catkin_add_executable_with_gtest)
  function(${name} target)
    cmake_parse_arguments(ARG "EXCLUDE_FROM_ALL" "TIMEOUT" "" ${ARGN})
    add_executable(${target} EXCLUDE_FROM_ALL ${ARG_UNPARSED_ARGUMENTS})
    target_link_libraries(${target} GTest::gtest Threads::Threads)
  endfunction()
endforeach()

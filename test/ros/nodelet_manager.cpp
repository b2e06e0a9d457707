#include <nodelet/loader.h>
#include <ros/ros.h>

#include <boost/smart_ptr/detail/sp_counted_base.hpp>
#include <string>

/// The loader takes the executable's copy of what many libraries have: here one in which the thread sanitizer sees that
/// the last owner of a message comes after all others.
__attribute__((used)) const auto release = &boost::detail::sp_counted_base::release;

/// `nodelet manager` and `nodelet standalone PACKAGE/Type`, compiled here: the sanitizers must be in the executable,
/// and the system's has none.
int main(int argc, char** argv) {
  ros::init(argc, argv, "manager");
  // Its destructor has its last callbacks unload what is gone already.
  static nodelet::Loader& loader = *new nodelet::Loader;
  if (argc > 2 && std::string(argv[1]) == "standalone" && !loader.load(ros::this_node::getName(), argv[2], {}, {}))
    return 1;
  ros::spin();
  loader.clear();
  return 0;
}

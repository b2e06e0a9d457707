#include <nodelet/loader.h>
#include <ros/ros.h>

/// `nodelet manager`, compiled here: the sanitizers must be in the executable, and the system's has none.
int main(int argc, char** argv) {
  ros::init(argc, argv, "manager");
  nodelet::Loader loader;
  ros::spin();
  return 0;
}

#pragma once

#include <ros/message_traits.h>

#include <boost/make_shared.hpp>
#include <filesystem>
#include <stdexcept>
#include <string>

#include "../ros/output_files.hpp"

namespace sdvo {

/// A bag that appears under its name only once it is complete. Never in the place of a file that holds something.
class BagWriter {
  template <class Action>
  auto guard(const std::string& what, const Action& action) const {
    try {
      return action();
    } catch (const std::exception& e) {
      throw std::runtime_error(name_ + ": cannot " + what + " (is the disk full?): " + e.what());
    }
  }

 public:
  BagWriter(const std::string& path, const std::string& tool)
      : name_("--output '" + path + "'"), caller_("/" + tool), file_(newFile(path)), bag_(begin()) {}

  template <class Message>
  void write(const std::string& topic, const ros::Time& time, const Message& message) {
    guard("write", [&] { bag_->write(topic, time, message); });
  }

  /// As write(), but `rosbag play` will latch the topic.
  template <class Message>
  void writeLatched(const std::string& topic, const ros::Time& time, const Message& message) {
    const auto header = boost::make_shared<ros::M_string>();
    (*header)["callerid"] = caller_;
    (*header)["latching"] = "1";
    (*header)["type"] = ros::message_traits::datatype<Message>();
    (*header)["md5sum"] = ros::message_traits::md5sum<Message>();
    (*header)["message_definition"] = ros::message_traits::definition<Message>();
    guard("write", [&] { bag_->write(topic, time, message, header); });
  }

  void commit() {
    guard("write", [&] {
      bag_.close();
      file_.commit();
    });
  }

 private:
  static std::string newFile(const std::string& path) {
    const bool is_file = std::filesystem::is_regular_file(path);
    if (is_file && !std::filesystem::is_empty(path))
      throw std::runtime_error("--output '" + path + "' exists and stays: give another name, or remove it");
    return std::filesystem::absolute(path).string();
  }

  OutputBag begin() const {
    return guard("create", [&] { return OutputBag(file_.partial()); });
  }

  const std::string name_, caller_;
  WholeFile file_;
  OutputBag bag_;
};

}  // namespace sdvo

#include <algorithm>
#include <atomic>
#include <cmath>
#include <iterator>
#include <map>
#include <memory>
#include <mutex>
#include <numeric>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include <diagnostic_updater/diagnostic_updater.h>
#include <geometry_msgs/TransformStamped.h>
#include <message_filters/subscriber.h>
#include <message_filters/sync_policies/exact_time.h>
#include <message_filters/synchronizer.h>
#include <nodelet_topic_tools/nodelet_lazy.h>
#include <openpose_ros_msgs/PersonDetection_3dArray.h>
#include <openpose_ros_msgs/joints.h>
#include <pluginlib/class_list_macros.hpp>
#include <sensor_msgs/PointCloud2.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>

#include "people_labeller.h"

namespace openpose_ros_nodelets
{
namespace
{

using diagnostic_msgs::DiagnosticStatus;
using openpose_ros_msgs::BodypartDetection_3d;
using openpose_ros_msgs::PersonDetection_3d;
using openpose_ros_msgs::PersonDetection_3dArray;
using openpose_ros_msgs::PersonDetection_3dArrayConstPtr;
using sensor_msgs::PointCloud2;
using sensor_msgs::PointCloud2ConstPtr;

static_assert(std::size(openpose_ros_msgs::COCO_18_JOINTS) == JOINTS, "the same joints, in the same order");

// Of an inferred joint whose standard deviation is not known [m].
constexpr float UNKNOWN_SIGMA = 0.15f;
// People are published with the transform at hand, which may come here a little later [s].
constexpr double TRANSFORM_PATIENCE = 0.1;
// Stamps that jump back by more are those of a recording that begins again [s]; less is a late message.
constexpr double BACKSTEP = 0.5;
// A warning keeps the status at WARN for this long; an input without a message for as long is silent [s].
constexpr double RECENT = 5.0;

Skeleton skeletonOf(const PersonDetection_3d& person, const Eigen::Isometry3f& to_cloud)
{
  Skeleton skeleton;
  for (std::size_t joint = 0; joint < JOINTS; ++joint)
  {
    const BodypartDetection_3d& part = openpose_ros_msgs::partOf(person, openpose_ros_msgs::COCO_18_JOINTS[joint]);
    if (!openpose_ros_msgs::isKnown(part))
      continue;
    skeleton[joint].position = to_cloud * Eigen::Vector3f(part.x, part.y, part.z);
    if (part.status == BodypartDetection_3d::INFERRED)
      skeleton[joint].uncertainty = std::isfinite(part.sigma) ? part.sigma : UNKNOWN_SIGMA;
  }
  return skeleton;
}

/// Return the ids of the scene and of people, which are numbered where an id is there twice, or 0.
std::vector<std::uint32_t> idsOf(const std::vector<PersonDetection_3d>& people)
{
  std::vector<std::uint32_t> ids{ 0 };
  for (const PersonDetection_3d& person : people)
    ids.push_back(person.person_ID);
  if (std::set<std::uint32_t>(ids.begin(), ids.end()).size() < ids.size())
    std::iota(ids.begin(), ids.end(), 0);
  return ids;
}

/// Return the name of a frame without a leading slash, which tf allowed and tf2 refuses.
std::string frameName(const std::string& name)
{
  return name.rfind('/', 0) == 0 ? name.substr(1) : name;
}

}  // namespace

/// Cloud and people of the same stamp -> the cloud with a label for each point, and the cloud without the people.
class PeopleCloud : public nodelet_topic_tools::NodeletLazy
{
private:
  using Policy = message_filters::sync_policies::ExactTime<PointCloud2, PersonDetection_3dArray>;

  void onInit() override
  {
    NodeletLazy::onInit();
    timer_ever_subscribed_.stop();  // being lazy is no reason for a warning
    LabelSettings settings;
    settings.looseness = parameter("looseness", settings.looseness, 0.2, 3.0);
    settings.cluster_step = parameter("cluster_step", settings.cluster_step, 0.001, 0.2);
    settings.floor_margin = parameter("floor_margin", settings.floor_margin, 0.001, 0.2);
    queue_size_ = parameter("queue_size", 30, 1, 1000);
    refuseUnknownParameters();
    labeller_ = std::make_unique<PeopleLabeller>(settings);
    listener_ = std::make_unique<tf2_ros::TransformListener>(buffer_, *nh_);
    updater_ = std::make_unique<diagnostic_updater::Updater>(*nh_, *pnh_, getName());
    updater_->setHardwareID("none");
    updater_->add(getName().substr(getName().find_first_not_of('/')), this, &PeopleCloud::report);
    // wall time, so that diagnostics do not stop with the simulated clock
    timer_ = nh_->createWallTimer(ros::WallDuration(1), [this](const ros::WallTimerEvent&) { updater_->force_update(); });
    labelled_publisher_ = advertise<PointCloud2>(*pnh_, "labelled", 1);
    without_people_publisher_ = advertise<PointCloud2>(*pnh_, "without_people", 1);
    onInitPostProcess();
  }

  /// Return a number within its limits. Throws std::runtime_error.
  double parameter(const std::string& key, double fallback, double least, double greatest)
  {
    known_.insert(key);
    double value = fallback;
    if (pnh_->hasParam(key) && (!pnh_->getParam(key, value) || !(value >= least && value <= greatest)))
      refuse("parameter '" + key + "' is not allowed: a number in " + std::to_string(least) + " .. " +
             std::to_string(greatest));
    return value;
  }

  void refuseUnknownParameters() const
  {
    std::vector<std::string> names;
    pnh_->getParamNames(names);
    const std::string prefix = pnh_->getNamespace() + "/";
    for (const std::string& name : names)
      if (name.compare(0, prefix.size(), prefix) == 0 && known_.count(name.substr(prefix.size())) == 0)
        refuse("unknown parameter '" + name.substr(prefix.size()) + "'");
  }

  [[noreturn]] void refuse(const std::string& text) const
  {
    NODELET_FATAL("%s. If it was not set on purpose, an earlier start left it: rosparam delete %s", text.c_str(),
                  getName().c_str());
    throw std::runtime_error(text);
  }

  void subscribe() override
  {
    arrival_ = ros::WallTime::now().toSec();
    synchronizer_ = std::make_unique<message_filters::Synchronizer<Policy>>(Policy(queue_size_), clouds_, people_);
    synchronizer_->getPolicy()->setReset(true);
    synchronizer_->registerCallback(&PeopleCloud::label, this);
    synchronizer_->getPolicy()->registerDropCallback(&PeopleCloud::countDropped, this);
    clouds_.subscribe(*nh_, "points", queue_size_);
    people_.subscribe(*nh_, "people", queue_size_);
  }

  void unsubscribe() override
  {
    clouds_.unsubscribe();
    people_.unsubscribe();
    synchronizer_.reset();  // and the clouds that wait
    arrival_ = 0;
  }

  void countDropped(const PointCloud2ConstPtr& cloud, const PersonDetection_3dArrayConstPtr& people)
  {
    if (cloud)
      count("clouds without people");  // detection does not look at every cloud
    if (people)
      warn("people without cloud", "no cloud has the stamp " + std::to_string(people->header.stamp.toSec()));
  }

  void label(const PointCloud2ConstPtr& cloud, const PersonDetection_3dArrayConstPtr& people)
  {
    arrival_ = ros::WallTime::now().toSec();
    try
    {
      publish(*cloud, *people);
      count("frames");
    }
    catch (const BadInputError& error)
    {
      warn("bad clouds", error.what());
    }
    catch (const tf2::TransformException& error)
    {
      warn("no transform", "from '" + people->header.frame_id + "' to '" + cloud->header.frame_id + "': " + error.what());
    }
  }

  void publish(const PointCloud2& cloud, const PersonDetection_3dArray& people)
  {
    const OrganizedCloud points(cloud);
    const Eigen::Isometry3f to_cloud = transform(people.header.frame_id, cloud.header);
    std::vector<Skeleton> skeletons;
    for (const PersonDetection_3d& person : people.persons)
      skeletons.push_back(skeletonOf(person, to_cloud));
    std::vector<std::uint32_t> labels = labeller_->label(points, skeletons);
    if (without_people_publisher_.getNumSubscribers() > 0)
      without_people_publisher_.publish(withoutLabelled(cloud, labels));
    if (labelled_publisher_.getNumSubscribers() == 0)
      return;
    const std::vector<std::uint32_t> ids = idsOf(people.persons);
    for (std::uint32_t& label : labels)
      label = ids[label];
    labelled_publisher_.publish(withLabels(cloud, labels));
  }

  /// Return the transform from the frame of the people to that of the cloud, at its stamp. Throws TransformException.
  Eigen::Isometry3f transform(const std::string& frame, const std_msgs::Header& cloud)
  {
    Eigen::Isometry3f transform = Eigen::Isometry3f::Identity();
    const std::string source = frameName(frame), target = frameName(cloud.frame_id);
    if (source == target)
      return transform;
    if ((newest_ - cloud.stamp).toSec() > BACKSTEP)
      buffer_.clear();  // but for static transforms
    newest_ = cloud.stamp;
    // in wall time: with a simulated clock that stops, tf2 itself would wait without end
    const ros::WallTime deadline = ros::WallTime::now() + ros::WallDuration(TRANSFORM_PATIENCE);
    while (!buffer_.canTransform(target, source, cloud.stamp) && ros::WallTime::now() < deadline)
      ros::WallDuration(0.005).sleep();
    const geometry_msgs::Transform found = buffer_.lookupTransform(target, source, cloud.stamp).transform;
    transform.translate(Eigen::Vector3f(found.translation.x, found.translation.y, found.translation.z));
    transform.rotate(Eigen::Quaternionf(found.rotation.w, found.rotation.x, found.rotation.y, found.rotation.z));
    return transform;
  }

  void count(const std::string& event)
  {
    std::lock_guard<std::mutex> lock(mutex_);
    ++counts_[event];
  }

  void warn(const std::string& event, const std::string& text)
  {
    NODELET_WARN_THROTTLE(RECENT, "%s: %s", event.c_str(), text.c_str());
    std::lock_guard<std::mutex> lock(mutex_);
    ++counts_[event];
    last_warning_ = event + ": " + text;
    warned_ = ros::WallTime::now().toSec();
  }

  void report(diagnostic_updater::DiagnosticStatusWrapper& status)
  {
    std::lock_guard<std::mutex> lock(mutex_);
    const double now = ros::WallTime::now().toSec(), arrival = arrival_;
    if (now - warned_ <= RECENT)
      status.summary(DiagnosticStatus::WARN, last_warning_);
    else if (arrival > 0 && now - arrival > RECENT)
      status.summary(DiagnosticStatus::WARN, "no cloud and people of one stamp on " + nh_->resolveName("points") +
                                             " and " + nh_->resolveName("people"));
    else
      status.summary(DiagnosticStatus::OK, arrival > 0 ? "working" : "idle: no subscriber");
    for (const auto& [event, number] : counts_)
      status.add(event, number);
  }

  std::set<std::string> known_{ "lazy", "verbose_connection", "use_multithread_callback",
                                "duration_to_warn_no_connection" };  // NodeletLazy reads these
  int queue_size_;
  std::unique_ptr<PeopleLabeller> labeller_;
  tf2_ros::Buffer buffer_;
  std::unique_ptr<tf2_ros::TransformListener> listener_;
  ros::Time newest_;
  message_filters::Subscriber<PointCloud2> clouds_;
  message_filters::Subscriber<PersonDetection_3dArray> people_;
  std::unique_ptr<message_filters::Synchronizer<Policy>> synchronizer_;
  ros::Publisher labelled_publisher_, without_people_publisher_;
  std::unique_ptr<diagnostic_updater::Updater> updater_;
  ros::WallTimer timer_;
  std::mutex mutex_;  // guards the counts and the last warning
  std::map<std::string, std::size_t> counts_;
  std::string last_warning_;
  double warned_ = 0;
  std::atomic<double> arrival_{ 0 };  // of the newest pair, before the first of the subscription; 0: not subscribed [s]
};

}  // namespace openpose_ros_nodelets

PLUGINLIB_EXPORT_CLASS(openpose_ros_nodelets::PeopleCloud, nodelet::Nodelet)

# The project in a container: the same ./run as on a machine.
#
#   docker build -t openpose_ros .                 # or with --build-arg BASE=debian:trixie, debian:bullseye
#   docker run --rm -v "$PWD/demo_output:/openpose_ros/demo_output" openpose_ros demo
#   docker run --rm openpose_ros test
#   docker run --rm -it --net=host openpose_ros launch openpose_ros_pkg openpose_ros_node.launch
#
# With RViz on your own screen:
#   docker run --rm -it -e DISPLAY -v /tmp/.X11-unix:/tmp/.X11-unix openpose_ros demo --rviz
ARG BASE=debian:bookworm
FROM $BASE
COPY . /openpose_ros
WORKDIR /openpose_ros
RUN ./run setup && rm -rf /var/lib/apt/lists/* /root/.cache/pip
ENTRYPOINT ["./run"]
CMD ["help"]

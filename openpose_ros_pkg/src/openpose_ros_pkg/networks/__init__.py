"""The networks: model registry, weights, runtimes. An image goes in, fields or poses come out."""

"""What is known of bodies: bones, sizes, surfaces, joint sets."""

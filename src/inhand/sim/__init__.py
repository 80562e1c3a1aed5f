"""Hands, objects and the engines that simulate them."""
